"""Virtual and recorded presses agree in statistics and shading within a quarter.

docs/reference/accuracy.md shows the same measurement.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import real_beside_virtual as beside

QUARTER = 0.25


def near(ratio: np.ndarray, share: float = QUARTER) -> None:
    np.testing.assert_allclose(ratio, 1, atol=share)


@pytest.fixture(scope="module")
def hex_pairs(recordings: Path) -> list[beside.Pair]:
    return beside.hex_pairs(recordings)


@pytest.fixture(scope="module")
def grid_pair(recordings: Path) -> beside.Pair:
    return beside.grid_pair(recordings)


@pytest.mark.recordings
def test_the_three_colour_fingertip(hex_pairs: list[beside.Pair]) -> None:
    for pair in hex_pairs:
        near(pair.mean)
        near(pair.spread)
        near(pair.change.mean())
        near(pair.change, share=0.4)  # one channel of one press
        for line in pair.lines:
            near(line.amplitude)
            assert line.correlation > 0.95
    # The colour distribution of the reference image depends on the dome.
    assert hex_pairs[0].tint.min() > 0.8


@pytest.mark.recordings
def test_the_six_lights_over_a_grid_of_balls(grid_pair: beside.Pair) -> None:
    near(grid_pair.mean)
    near(grid_pair.spread)
    near(grid_pair.change)
    for line in grid_pair.lines:
        near(line.amplitude)
        assert line.correlation > 0.95


@pytest.mark.recordings
def test_the_page_shows_the_measured_values(
    hex_pairs: list[beside.Pair], grid_pair: beside.Pair
) -> None:
    shown = beside.PAGE.read_text(encoding="utf-8").partition(beside.BEGIN)[2].partition(beside.END)
    measured = beside.tables([*hex_pairs, grid_pair])

    def numbers(text: str) -> list[float]:
        return [float(number) for number in re.findall(r"\d\.\d\d", text)]

    np.testing.assert_allclose(numbers(shown[0]), numbers(measured), atol=0.03)
