"""Samples of units: kept on disk, mirrored, and read from a recording with a table of forces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.images import write_png
from tactile_core.interfaces.calibration import Silent
from tactile_core.profiles.loader import load_profile
from tactile_train.samples import (
    UnitSamples,
    kept_samples,
    mirrored_channels,
    recorded_samples,
    sample_size,
)
from tactile_train.virtual_forces import TRAINING_OBJECTS

SMALL = {"image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1104}}
HEADER = "frame,fx_n,fy_n,fz_n,tz_nmm"


def test_the_fingertip_in_the_mirror_has_green_and_blue_swapped() -> None:
    assert mirrored_channels([90, 210, 330]) == (0, 2, 1)
    assert mirrored_channels([0, 90]) is None
    assert mirrored_channels([]) is None


def test_the_size_of_the_samples_is_a_whole_number_of_cells() -> None:
    assert sample_size(load_profile("hex_fingertip", sim=True)) == (160, 120)


def test_rendered_samples_are_kept(tmp_path: Path) -> None:
    design = load_profile("hex_fingertip", sim=True, overrides=SMALL)
    path = tmp_path / "data" / "unit_0003.npz"
    made = kept_samples(path, design, 3, objects=TRAINING_OBJECTS, count=2, half=False)
    again = kept_samples(path, design, 3, objects=(), count=0, half=True)
    assert np.array_equal(made.images, again.images)
    assert again.loads is not None
    assert again.relative * again.shear_modulus_mpa == pytest.approx(made.wrenches, rel=1e-5)
    assert len(again.part(np.array([True, False])).labels) == 1


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    rng = np.random.default_rng(0)
    for folder, count in (("reference", 1), ("frames", 6)):
        (tmp_path / folder).mkdir()
        for number in range(count):
            pixels = rng.integers(100, 130, (120, 160, 3), np.uint8)
            write_png(tmp_path / folder / f"{number}.png", pixels)
    return tmp_path


def samples(recording: Path, lines: list[str]) -> dict[str, UnitSamples]:
    forces = recording / "forces.csv"
    forces.write_text("\n".join(lines))
    profile = load_profile("hex_fingertip", overrides=SMALL)
    return recorded_samples(
        profile, recording / "frames", forces, recording / "reference", Silent()
    )


def test_frames_of_a_recording_get_their_forces_by_name(recording: Path) -> None:
    lines = [f"{HEADER},sequence", *(f"{k},0,0,{k},1,{'abc'[k % 3]}" for k in range(6))]
    found = samples(recording, lines)
    assert found["b"].wrenches[:, 2] == pytest.approx([1, 4])
    assert found["a"].images.shape == (2, 120, 160, 3)
    assert found["a"].reference.mean() == pytest.approx(115, abs=1)


def test_without_sequences_there_are_five_parts(recording: Path) -> None:
    found = samples(recording, [HEADER, *(f"{k},0,0,{k},1" for k in range(6))])
    assert len(found) == 5
    assert sum(len(one.images) for one in found.values()) == 6


def test_files_may_name_the_frames(recording: Path) -> None:
    lines = [HEADER.replace("frame", "file"), *(f"{k}.png,0,0,{k},1" for k in range(6))]
    assert sum(one.wrenches[:, 2].sum() for one in samples(recording, lines).values()) == 15


def test_few_forces_are_refused(recording: Path) -> None:
    with pytest.raises(InputError, match="has 1 forces; give at least 5"):
        samples(recording, [HEADER, "1,0,0,0,0"])


def test_a_force_without_a_frame_is_refused(recording: Path) -> None:
    with pytest.raises(InputError, match="has a force for the frame '77'"):
        samples(recording, [HEADER, *(f"{k},0,0,0,0" for k in (0, 1, 2, 3, 77))])


@pytest.mark.parametrize("line", ["0,0,,1,0", "0,0,0,1,"])
def test_a_missing_component_is_refused(recording: Path, line: str) -> None:
    with pytest.raises(InputError, match="needs all of fx_n, fy_n, fz_n and tz_nmm"):
        samples(recording, [HEADER, line, *(f"{k},0,0,0,0" for k in range(1, 6))])
