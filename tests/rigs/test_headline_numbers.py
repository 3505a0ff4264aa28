"""The published accuracies, measured again by the complete chain on all their recordings.

`python benchmarks/accuracy.py` measures and describes the same rows.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments import given_lights, grids, groove, marker_rows, presses, slip_rows
from experiments.press_sets import SETS, Presses
from experiments.table_row import Row

pytestmark = [pytest.mark.recordings, pytest.mark.headline]

SIX_LED_DEG = {"001 → 002": 0.87, "002 → 001": 1.00}
FOUR_COLOUR_DEG = {"001 → 002": 1.24, "002 → 001": 1.24}
PRESSES_DEG = {
    "objectfolder": {"even → odd": 2.32, "odd → even": 2.20},
    "wedge": {"even → odd": 2.61, "odd → even": 2.33},
    "gelsight_mini": {"even → odd": 1.82, "odd → even": 2.11},
    "hex_fingertip": {"even → odd": 6.38, "odd → even": 5.33},
}
SPHERE = {"objectfolder": 0.03, "wedge": 0.04, "gelsight_mini": 0.02}
GROOVES_PERCENT = {"upper → lower": 4.42, "lower → upper": 2.35}
BEAR_DEG = 7.82
MARKERS_PX, MARKERS_KEPT_PERCENT = 0.506, 98.4
SLIPS, SLIPS_FOUND, FALSE_ALARMS = 19, 19, 0
SLIP_AREA, SLIP_CONTROL = 1.0, 0.933
GRIPPER_AREA, GRIPPER_CONTROL = 0.901, 0.656

DEGREES = 0.1
"""Tolerance of the published errors of normals between machines."""


def only(rows: list[Row]) -> Row:
    (row,) = rows
    return row


@pytest.mark.parametrize(
    ("which", "published"), [(grids.SIX, SIX_LED_DEG), (grids.FOUR, FOUR_COLOUR_DEG)]
)
def test_errors_on_another_grid_are_as_published_in_both_directions(
    recordings: Path, which: grids.Grids, published: dict[str, float]
) -> None:
    row = only(grids.rows(recordings, which))
    assert row.values == pytest.approx(published, abs=DEGREES)
    assert row.value == max(row.values.values())
    assert row.value < 0.05 * min(row.control.values()), "far better than the flat baseline"


@pytest.mark.parametrize("chosen", SETS, ids=lambda chosen: str(chosen.name))
def test_errors_on_held_out_presses_are_as_published_in_both_directions(
    recordings: Path, chosen: Presses
) -> None:
    row = only(presses.rows(recordings, chosen, folds=False))
    published = PRESSES_DEG[chosen.name]
    assert row.values == pytest.approx(published, rel=0.05, abs=DEGREES)
    if chosen.name in SPHERE:
        ratios = [value for name, value in row.also.items() if name.startswith("sphere")]
        assert ratios == pytest.approx([1, 1], abs=SPHERE[chosen.name])


def test_depths_of_grooves_on_held_out_rows_are_as_published(recordings: Path) -> None:
    row = only(groove.rows(recordings))
    assert row.values == pytest.approx(GROOVES_PERCENT, abs=1)


def test_the_error_of_an_object_under_given_lights_is_as_published(recordings: Path) -> None:
    row = only(given_lights.rows(recordings))
    assert row.value == pytest.approx(BEAR_DEG, abs=DEGREES)
    assert row.value < row.control["least squares of the six lights"]


def test_marker_tracking_is_as_accurate_as_published(recordings: Path) -> None:
    distance, kept = marker_rows.rows(recordings)
    assert distance.value == pytest.approx(MARKERS_PX, abs=0.05)
    assert distance.also["swapped"] == 0
    assert kept.value == pytest.approx(MARKERS_KEPT_PERCENT, abs=1)


def test_slip_is_reported_in_as_many_lifts_as_published(recordings: Path) -> None:
    found, areas = slip_rows.lifts(recordings)
    assert found.also["slips"] == SLIPS
    assert found.also["slips reported"] == SLIPS_FOUND
    assert found.also["false alarms on held lifts, %"] == FALSE_ALARMS
    assert found.also["reported before the lift"] == 0
    assert found.also["frames before the end, median"] >= 8
    assert areas.values["all"] == pytest.approx(SLIP_AREA, abs=0.01)
    assert areas.control["strength of the first imprint"] == pytest.approx(SLIP_CONTROL, abs=0.01)


@pytest.mark.timeout(1800)
def test_slip_between_two_fingers_is_reported_as_well_as_published(recordings: Path) -> None:
    row = only(slip_rows.gripper(recordings))
    assert row.value == pytest.approx(GRIPPER_AREA, abs=0.02)
    control = row.control["strength of the first imprint"]
    assert control == pytest.approx(GRIPPER_CONTROL, abs=0.02)
