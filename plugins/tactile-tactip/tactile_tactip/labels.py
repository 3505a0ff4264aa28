"""The labels of presses: distance and angle of the surface in each frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.errors import InputError
from tactile_core.formats.scan import finite_number, observation_name, read_table
from tactile_core.formats.text import printable

COLUMNS = ("file", "distance_mm", "angle_deg")  # The columns unless others are named


@dataclass(frozen=True, eq=False)
class Labels:
    """Distance and angle of the surface by the name of the frame's file.

    Attributes
    ----------
    path : Path
    poses : dict of str to (float, float)
        mm and degrees, by the file's name without its ending.
    """

    path: Path
    poses: dict[str, tuple[float, float]]

    def of_frames(self, sources: Sequence[str], recording: Path) -> Float64:
        """(N, 2) distance in mm and angle in degrees of frames with these names, each labelled.

        Raises
        ------
        InputError
            A frame has no label, or a label no frame.
        """
        names = [observation_name(source) for source in sources]
        unlabelled = [name for name in names if name not in self.poses]
        unseen = sorted(set(self.poses) - set(names))
        if unlabelled or unseen:
            example = (
                f"frame {printable(unlabelled[0])} has no label"
                if unlabelled
                else f"label {printable(unseen[0])} has no frame"
            )
            raise InputError(
                f"{recording} has {len(names)} frames and {self.path} {len(self.poses)} labels: "
                f"{example}; give one line for each frame, and no other"
            )
        return np.array([self.poses[name] for name in names])


def read_pose_labels(path: Path, columns: Sequence[str] = COLUMNS) -> Labels:
    """Read a CSV file with one line for each frame.

    Parameters
    ----------
    path : Path
    columns : (file, distance, angle)
        Names of the columns: the frame's file, the distance in mm, the angle in degrees.

    Raises
    ------
    InputError
        The file is missing, has no such column, or a line is invalid; the message names the line.
    """
    path = Path(path)
    if len(columns) != len(COLUMNS):
        raise InputError(
            f"--columns {','.join(columns)}: name three, those of file, distance and angle, as in "
            f"--columns {','.join(COLUMNS)}"
        )
    there, lines = read_table(path)
    missing = [name for name in columns if name not in there]
    if missing:
        raise InputError(
            f"{path}:1: column {printable(missing[0])!r} is missing, there are "
            f"{', '.join(map(printable, there[:12]))}; name those of file, distance in mm and "
            f"angle in degrees by --columns"
        )
    file, distance, angle = columns
    poses: dict[str, tuple[float, float]] = {}
    for where, cells in lines:
        name = observation_name(cells[file])
        if not name or name in poses:
            what = f"{printable(name)} already has a label" if name else f"{file!r} is empty"
            raise InputError(f"{where}: {what}; give one line for each frame")
        values = (finite_number(cells[one], one, where) for one in (distance, angle))
        poses[name] = next(values), next(values)
    if not poses:
        raise InputError(f"{path} has no line with a label")
    return Labels(path, poses)
