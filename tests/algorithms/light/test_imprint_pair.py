"""Two equal imprints are as far apart as their autocorrelation says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from experiments.measured_scale import pair, pair_errors
from tactile_core.algorithms.light.sequence import imprint_distance
from tactile_core.formats.images import read_image


@pytest.mark.parametrize("kind", ["balls", "tips"])
def test_the_error_on_virtual_presses_is_as_published(kind: str) -> None:
    errors = np.array(list(pair_errors(kind)))
    assert np.median(errors) <= 0.01
    assert errors.max() <= 0.015


def test_an_undeformed_gel_shows_no_pair() -> None:
    _, undeformed, _ = pair("balls", 6.0, 0)
    assert imprint_distance(undeformed, undeformed) is None


def test_a_single_ball_is_no_pair(recordings: Path) -> None:
    folder = recordings / "gelsight_mini" / "ball_presses"
    undeformed = read_image(folder / "background.png")
    for press in sorted(folder.glob("press_*.png")):
        assert imprint_distance(read_image(press), undeformed) is None, press.name
