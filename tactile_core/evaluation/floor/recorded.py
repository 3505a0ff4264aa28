"""The least force of a sensor, from a recording with measured forces."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.errors import InputError
from tactile_core.evaluation.floor.virtual import FLOOR, Floor, estimates, floor_of
from tactile_core.formats.labels import read_forces
from tactile_core.interfaces.calibrator import Progress, Silent
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.model import Profile

# Which measured force each estimate is compared with.
_COLUMNS = {"fx": 0, "fy": 1, "fz": 2, "load": 2}


def recorded_floors(
    profile: Profile | str | Path,
    *,
    input: Path,
    forces: Path,
    bundle: Path | None = None,
    reference: Path | str | None = None,
    serial: str | None = None,
    progress: Progress | None = None,
) -> list[Floor]:
    """Judge the frames of a recording by their measured forces.

    A frame with less than a hundredth of the largest force is at rest.

    Parameters
    ----------
    profile, input, bundle, reference, serial
        As for :func:`~tactile_core.pipeline.opening.open_sensor`.
    forces : Path
        CSV with ``frame`` or ``file`` and some of ``fx_n,fy_n,fz_n``.

    Raises
    ------
    InputError
        No step gives a force, or frames and forces do not match.
    """
    table = read_forces(forces)
    if table.key == "time_s":
        raise InputError(f"{forces}: name the frames by 'frame' or 'file', not by time_s")
    rows = dict(zip(table.rows, table.forces, strict=True))
    taken: list[tuple[dict[str, float], Float64]] = []
    progress = progress or Silent()
    progress.stage("measuring the recording", 1.0)
    found = 0
    with open_sensor(
        profile, input=input, bundle=bundle, reference=reference, serial=serial
    ) as sensor:
        for number, reading in enumerate(sensor.stream()):
            name = table.name_of(reading.frame.sequence, reading.source)
            if name not in rows:
                continue
            found += 1
            if number or not reading.relative:  # the reference itself differs by nothing
                taken.append((estimates(reading), rows[name]))
            progress.fraction(min(1.0, (number + 1) / max(1, len(rows))))
    if found < len(rows):
        raise InputError(
            f"{forces} names {len(rows)} frames, of which {input} has {found}; give the "
            f"forces of this recording"
        )
    if not taken:
        raise InputError(f"{forces} names only the frame that is the reference; name others too")
    return [floor for key in taken[0][0] if (floor := _floor(key, input.stem, taken)) is not None]


def _floor(key: str, name: str, taken: list[tuple[dict[str, float], Float64]]) -> Floor | None:
    """Floor of one estimate; None if its force was not measured."""
    forces = np.array([row for _, row in taken])[:, _COLUMNS[key]]
    found = np.array([one[key] for one, _ in taken])
    known = np.isfinite(forces)
    if not known.any():
        return None
    forces, found = forces[known], found[known]
    calm = np.abs(forces) < FLOOR.rest_share * np.abs(forces).max()
    return floor_of(key, name, found[calm], forces[~calm], found[~calm])
