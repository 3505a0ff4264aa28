"""Frames beside forces: by name, by time, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.calibration.force.labelled import label_frames
from tactile_core.calibration.force.recorded_features import RecordedFeatures
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.labels import ForceTable

TIMES_S = np.arange(90) / 30


def force_of(times_s: Float64) -> Float64:
    """Three presses of different strength, N."""
    return np.asarray(
        sum(
            n * np.exp(-(((times_s - at) / 0.15) ** 2))
            for n, at in ((1.0, 0.6), (2.0, 1.4), (1.5, 2.3))
        )
    )


def recording(name: str = "a", gain: float = 0.5) -> RecordedFeatures:
    features = gain * force_of(TIMES_S)[:, None]
    sources = tuple(f"{name}{number}" for number in range(90))
    return RecordedFeatures(name, tuple(range(90)), sources, TIMES_S, features)


def table(forces: Float64, key: str = "frame", name: str = "a") -> ForceTable:
    rows = tuple(f"{name}{row}" if key == "file" else str(row) for row in range(len(forces)))
    all_forces = np.full((len(forces), 4), np.nan)
    all_forces[:, 2] = forces
    return ForceTable(Path("forces.csv"), key, rows, np.zeros(0), all_forces)  # type: ignore[arg-type]


def timed(times_s: Float64, forces: Float64) -> ForceTable:
    all_forces = np.full((len(forces), 4), np.nan)
    all_forces[:, 2] = forces
    return ForceTable(Path("forces.csv"), "time_s", (), times_s, all_forces)


@pytest.mark.parametrize("key", ["frame", "file"])
def test_each_frame_has_the_force_of_its_line(key: str) -> None:
    found = label_frames([recording()], [table(force_of(TIMES_S), key)])
    assert len(found.sequences) == 3
    for one in found.sequences:
        np.testing.assert_allclose(one.forces[:, 2], one.features[:, 0] / 0.5)
        assert np.isnan(one.forces[:, 0]).all()


def test_frames_without_a_line_are_left_out() -> None:
    forces = force_of(TIMES_S)
    known = table(forces[:80])
    assert sum(len(one.forces) for one in label_frames([recording()], [known]).sequences) == 80


def test_several_recordings_are_a_sequence_each() -> None:
    both = label_frames([recording("a"), recording("b")], [table(force_of(TIMES_S))] * 2)
    assert [one.name for one in both.sequences] == ["a", "b"]


def test_one_file_can_name_the_files_of_all_recordings() -> None:
    forces = force_of(TIMES_S)
    a, b = table(forces, "file", "a"), table(2 * forces, "file", "b")
    shared = ForceTable(
        a.path, "file", a.rows + b.rows, a.times_s, np.concatenate([a.forces, b.forces])
    )
    found = label_frames([recording("a"), recording("b")], [shared])
    assert found.sequences[1].forces[:, 2] == pytest.approx(2 * forces)


def test_forces_with_a_clock_of_their_own_are_shifted() -> None:
    times_s = np.arange(-0.5, 4, 0.002)
    found = label_frames([recording()], [timed(times_s + 7.25, force_of(times_s))])
    assert found.offsets["a"].offset_s == pytest.approx(7.25, abs=0.005)
    for one in found.sequences:
        assert one.forces[:, 2] == pytest.approx(one.features[:, 0] / 0.5, abs=0.03)


def test_a_clock_without_a_common_press_is_refused() -> None:
    times_s = np.arange(0, 3, 0.01)
    noise = np.random.default_rng(0).normal(size=len(times_s))
    with pytest.raises(InputError, match="at no time offset"):
        label_frames([recording()], [timed(times_s, noise)])


def test_a_clipped_load_cell_is_refused() -> None:
    with pytest.raises(InputError, match=r"stays at its extreme, 1\.2, .* clipped"):
        label_frames([recording()], [table(np.minimum(force_of(TIMES_S), 1.2))])


def test_a_load_cell_that_was_not_zeroed_is_refused() -> None:
    with pytest.raises(InputError, match=r"fz_n is 0\.80.* was not zeroed"):
        label_frames([recording()], [table(force_of(TIMES_S) + 0.8)])


def test_a_constant_force_is_refused() -> None:
    with pytest.raises(CalibrationError, match="fz_n is the same in every frame"):
        label_frames([recording("a"), recording("b")], [table(np.ones(90))] * 2)


def test_frames_of_one_mass_are_one_sequence() -> None:
    masses = np.repeat([0.5, 1.0, 1.5], 30)
    found = label_frames([recording()], [table(masses, "file")], weights=True)
    assert [set(one.forces[:, 2]) for one in found.sequences] == [{0.5}, {1.0}, {1.5}]


def test_noise_of_another_component_divides_no_press() -> None:
    known = table(force_of(TIMES_S))
    known.forces[:, 3] = 1e-3 * np.random.default_rng(2).normal(size=90)
    assert len(label_frames([recording()], [known]).sequences) == 3
