"""The text lines of ``tactile run``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from tactile_core.cli.output import Warnings, print_if_fewer
from tactile_core.cli.run import _text
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import (
    ContactMask,
    Frame,
    HeightMap,
    MarkerField,
    Quantity,
    SlipState,
)


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
        ({"state": "unknown", "degree": 0.0, "reason": "no marker"}, "unknown (no marker)"),
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


def surface(height_mm: float, *, touched: bool) -> tuple[HeightMap, ContactMask]:
    everywhere = np.ones((4, 6), bool)
    height = HeightMap(np.full((4, 6), height_mm, np.float32), everywhere, 0.1)
    return height, ContactMask(everywhere & touched, 0.1)


def test_only_a_contact_is_deep() -> None:
    assert "0.302 mm deep, 0.24 mm² in contact" in words(*surface(0.302, touched=True))
    line = words(*surface(0.302, touched=False))
    assert "deep" not in line
    assert "height up to 0.302 mm, no contact" in line


def test_a_height_without_a_contact_mask_is_no_depth() -> None:
    line = words(surface(0.302, touched=True)[0])
    assert "deep" not in line
    assert "height up to 0.302 mm, no contact mask" in line


def test_each_warning_is_printed_once_whatever_its_numbers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    warnings = Warnings(["no bundle; make one"])
    for share in (3, 4, 12.5):
        warnings.print([f"{share} % of the frame is saturated; shorten the exposure"])
        warnings.print(["no bundle; make one"])
    warnings.print(["7 of 192 markers are seen; clean the gel"])
    assert capsys.readouterr().err.splitlines() == [
        "warning: 3 % of the frame is saturated; shorten the exposure",
        "warning: 7 of 192 markers are seen; clean the gel",
    ]


def test_fewer_frames_than_asked_for_are_said(capsys: pytest.CaptureFixture[str]) -> None:
    for came, asked in ((60, 60), (27, None)):
        print_if_fewer(came, asked)
    assert capsys.readouterr().err == ""
    print_if_fewer(27, 60)
    assert "only 27 of the 60 frames" in capsys.readouterr().err


@dataclass(frozen=True, eq=False)
class Temperature(Quantity):
    """A plugin's quantity, with words of its own."""

    kelvin: float

    def text(self) -> str:
        return f"{self.kelvin:.1f} K"


def test_a_quantity_of_a_plugin_prints_its_own_words() -> None:
    assert "293.2 K, " in words(Temperature(293.16))
    assert "no height" not in words(Temperature(293.16))
    assert "K" not in words(markers())
