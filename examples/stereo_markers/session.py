"""Sessions of a stereo camera that sees markers move in three dimensions, with a load cell."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.algorithms.arrays.types import Float64, Intp
from tactile_core.errors import InputError

TOUCHED_N = 0.15
"""Below this normal force a contact has just begun, and there is no shear yet."""


@dataclass(frozen=True)
class Session:
    """One session.

    Attributes
    ----------
    markers_mm : (M, 2) float64
        x and y of each marker on the undeformed gel.
    moved_mm : (N, M, 3) float64
        Displacement of each marker in each frame; z away from the camera.
    forces : (N, 4) float64
        fx, fy, fz in N and tz in N·mm: the load that the object puts on the sensor.
    segments : (N,) int
        Number of the press that each frame belongs to.
    """

    markers_mm: Float64
    moved_mm: Float64
    forces: Float64
    segments: Intp


def read_session(path: Path, *, drift_removed: bool = True) -> Session:
    """Read an HDF5 session: ``vision/dxyz``, ``reference/xyz_ref``, ``force/…``.

    Parameters
    ----------
    path : Path
    drift_removed : bool
        Subtract the line in time through the shear that the load cell shows where contacts begin:
        its zero drifts by 0.15 N within minutes.

    Raises
    ------
    InputError
        It is no such session.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            moved, markers = file["vision/dxyz"][:], file["reference/xyz_ref"][:]
            values, segments = file["force/values"][:], file["force/segment_id"][:]
            times_s = file["force/timestamp"][:]
    except (OSError, KeyError) as error:
        raise InputError(f"{path} is no session of stereo markers: {error}") from error
    if not len(moved) == len(values) == len(segments) or moved.shape[1:] != markers.shape:
        raise InputError(f"{path}: its forces do not belong to its frames")
    # the cell shows the reaction, negative in compression; torque in N·m
    forces = -np.asarray(values, np.float64)[:, [0, 1, 2, 5]] * [1, 1, 1, 1e3]
    if drift_removed:
        _remove_drift(forces, np.asarray(times_s, np.float64))
    xy = np.asarray(markers[:, :2], np.float64)
    return Session(xy, np.asarray(moved, np.float64), forces, np.asarray(segments, np.intp))


def _remove_drift(forces: Float64, times_s: Float64) -> None:
    begun = forces[:, 2] < TOUCHED_N
    if begun.sum() < 3:
        return
    time = (times_s - times_s.mean()) / max(float(np.ptp(times_s)), 1e-9)
    columns = np.stack([np.ones_like(time), time], 1)
    for component in (0, 1):
        weights = np.ones(int(begun.sum()))
        for _ in range(10):  # absolute deviations: a few contacts begin with shear
            scaled = columns[begun] * weights[:, None]
            line, *_ = np.linalg.lstsq(scaled, forces[begun, component] * weights, rcond=None)
            away = forces[begun, component] - columns[begun] @ line
            weights = 1 / np.sqrt(1 + (away / 0.05) ** 2)
        forces[:, component] -= columns @ line
