"""External inputs of an earlier run are replayed from its results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from support.readings import height, reading, saved

from tactile_core.errors import InputError
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import FieldSpec, Float32, Frame, Quantity
from tactile_core.recordings.recorded_source import SavedInputs


@dataclass(frozen=True, eq=False)
class Pose(Quantity):
    """Position of the gripper."""

    xyz_mm: Annotated[Float32, FieldSpec("mm", ("xyz",))]


def reading_with_pose(source: str, x_mm: float) -> Reading:
    pose = Pose(np.float32([x_mm, 0, 0]))
    return Reading(reading(source=source).frame, {}, {}, {Pose: pose})


def test_each_frame_gets_its_saved_inputs(tmp_path: Path) -> None:
    for number in (3, 5):
        saved(reading_with_pose(f"press_{number}", number), tmp_path, ["npz"])
    inputs = SavedInputs(tmp_path, {Pose})
    for number in (5, 3):
        (pose,) = inputs(reading(source=f"press_{number}").frame)
        assert isinstance(pose, Pose)
        assert pose.xyz_mm.tolist() == [number, 0, 0]


def test_a_frame_without_file_or_quantity_gets_no_inputs(tmp_path: Path) -> None:
    saved(reading(height(), source="a"), tmp_path, ["npz"])
    inputs = SavedInputs(tmp_path, {Pose})
    for source in ("a", "b"):
        frame: Frame = reading(source=source).frame
        assert inputs(frame) == ()


def test_a_missing_folder_and_a_foreign_file_are_rejected(
    tmp_path: Path,
) -> None:
    with pytest.raises(InputError, match="is not a folder; name one that an earlier run wrote"):
        SavedInputs(tmp_path / "nowhere", {Pose})
    np.savez(tmp_path / "a.npz", pose=np.zeros(3))
    with pytest.raises(InputError, match=r"a\.npz: these are not the arrays of a reading"):
        SavedInputs(tmp_path, {Pose})(reading(source="a").frame)
