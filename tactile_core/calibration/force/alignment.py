"""Forces in the axes of the image, about its centre, from those of a load cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.force_fit.cell_axes import (
    CellRotation,
    ToolOffset,
    about_centre,
    cell_rotation,
    tool_offset,
)
from tactile_core.interfaces.force_calibration import ForceSamples


class Alignment(NamedTuple):
    """Where the load cell is, as far as the forces determine it.

    Attributes
    ----------
    rotation : CellRotation or None
    offset : ToolOffset or None
    sequences : tuple of ForceSamples
        With forces in the image's axes, and torque about the image centre if the offset is
        determined.
    """

    rotation: CellRotation | None
    offset: ToolOffset | None
    sequences: tuple[ForceSamples, ...]


def aligned(sequences: Sequence[ForceSamples], names: Sequence[str]) -> Alignment:
    """Find the load cell's axes and position, and convert its forces.

    Parameters
    ----------
    sequences : sequence of ForceSamples
    names : sequence of str
        Names of the features; see
        :attr:`~tactile_core.interfaces.force_calibration.FittedForce.feature_names`.
    """
    forces = np.concatenate([one.forces for one in sequences])
    features = np.concatenate([one.features for one in sequences])
    column = {name: features[:, index] for index, name in enumerate(names)}
    shift = [column.get(name) for name in ("shift_x", "shift_y")]
    known = np.isfinite(forces[:, :2]).all(1)
    if not known.any() or any(one is None or not np.isfinite(one).all() for one in shift):
        return Alignment(None, None, tuple(sequences))
    normal = np.nan_to_num(forces[known, 2])
    rotation = cell_rotation(np.stack(shift, 1)[known], forces[known, :2], normal)  # type: ignore[arg-type]
    if rotation is not None:
        forces = forces.copy()
        forces[:, :2] = forces[:, :2] @ rotation.matrix.T
        forces[:, 3] *= -1 if rotation.mirrored else 1
    known &= np.isfinite(forces).all(1)
    offset = None
    if "moment" in column and known.any():
        offset = tool_offset(column["moment"][known], forces[known])
        if offset is not None and offset.determined:
            forces = about_centre(forces, offset)
    return Alignment(rotation, offset, _replaced(sequences, forces))


def _replaced(sequences: Sequence[ForceSamples], forces: Float64) -> tuple[ForceSamples, ...]:
    ends = np.cumsum([len(one.forces) for one in sequences])
    parts = np.split(forces, ends[:-1])
    return tuple(replace(one, forces=part) for one, part in zip(sequences, parts, strict=True))
