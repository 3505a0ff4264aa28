"""The text lines of ``tactile run``."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tactile_core.cli.run import _text
from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Frame, MarkerField, Quantity, SlipState


def words(*quantities: Quantity) -> str:
    frame = Frame(np.zeros((4, 6, 3), np.uint8), ("r", "g", "b"), 0.1, source="lift")
    reading = Reading(frame, {type(q): q for q in quantities}, {})
    return _text(reading, reading.summary())


def markers() -> MarkerField:
    at = np.zeros((3, 2), np.float32)
    return MarkerField(np.arange(3, dtype=np.int32), at, at, np.array([True, True, False]), 0.1)


@pytest.mark.parametrize(
    ("slip", "message"),
    [
        ({"state": "none", "degree": 0.0}, "no contact"),
        ({"state": "stick", "degree": 0.1}, "stick"),
        (
            {"state": "incipient", "degree": 0.42, "kind": "rotation"},
            "incipient (rotation, degree 0.42)",
        ),
    ],
)
def test_markers_and_slip_are_printed_if_the_chain_measures_them(
    slip: dict[str, Any], message: str
) -> None:
    line = words(markers(), SlipState(**slip))
    assert "2 of 3 markers seen" in line
    assert message in line


def test_quantities_outside_the_chain_are_not_printed() -> None:
    assert "marker" not in words()
