"""The least force that a sensor shows, virtual or recorded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import InputError
from tactile_core.evaluation.demo import calibrated_virtually
from tactile_core.formats.labels import read_forces
from tactile_core.interfaces.calibrator import Progress, Silent
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import RelativeLoad, Wrench
from tactile_core.sim.stage import VirtualStage


class FLOOR:
    """What counts as distinguished from none."""

    # [share of the readings at rest] A reading is distinguished if it differs from rest by more
    # than this quantile. Source: by hand, : one false alarm in a hundred frames.
    quantile = 0.99
    # [N] The slope is fitted to forces up to this. Source: by hand, : ten times the least force
    # of the review's table 1.
    near_zero_n = 0.5
    # [share of the largest force] A recorded frame with less force is at rest. Source: by hand, :
    # the error of a usual load cell.
    rest_share = 0.01
    # [count] With fewer frames at rest the quantile is not known. Source: by hand, then it is the
    # largest of them.
    fewest_at_rest = 5


@dataclass(frozen=True)
class Floor:
    """How well one number of the readings distinguishes a force from none.

    Attributes
    ----------
    estimate : str
        Which number: ``load``, ``fx``, ``fy`` or ``fz``.
    object : str
        What was pressed.
    rest_frames : int
    rest_std : float
        Standard deviation at rest; N, or without a unit for the load.
    rest_limit : float
        Difference from rest that 99 % of the readings at rest stay within.
    slope_per_n : float or None
        Reading per newton near zero force; None without forces there.
    least_n : float or None
        The smallest force from which on all readings differ from rest by more than
        ``rest_limit``; None if there is none.
    """

    estimate: str
    object: str
    rest_frames: int
    rest_std: float
    rest_limit: float
    slope_per_n: float | None
    least_n: float | None

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        return asdict(self)


def floor_of(
    estimate: str,
    pressed: str,
    rest: Sequence[float] | Float64,
    forces_n: Sequence[float] | Float64,
    readings: Sequence[float] | Float64,
) -> Floor:
    """Return the noise at rest, the slope near zero, and the least force.

    Parameters
    ----------
    estimate, pressed : str
        Names of the number and of the object.
    rest : (R,) float
        Readings without force.
    forces_n, readings : (N,) float
        True forces and their readings, in any order; the sign of a force does not matter.

    Raises
    ------
    InputError
        There are too few readings at rest, or none under force.
    """
    calm, forces, found = (np.asarray(given, np.float64) for given in (rest, forces_n, readings))
    if len(calm) < FLOOR.fewest_at_rest or not len(forces):
        raise InputError(
            f"the least force needs at least {FLOOR.fewest_at_rest} frames without force and one "
            f"with force, not {len(calm)} and {len(forces)}; record the sensor at rest as well"
        )
    middle = float(calm.mean())
    limit = float(np.quantile(np.abs(calm - middle), FLOOR.quantile))
    order = np.argsort(np.abs(forces))
    missed = np.flatnonzero(np.abs(found[order] - middle) <= limit)
    first = int(missed[-1]) + 1 if len(missed) else 0
    least = float(np.abs(forces[order[first]])) if first < len(order) else None
    near = np.abs(forces) <= FLOOR.near_zero_n
    square = float(np.sum(forces[near] ** 2))
    slope = float(np.sum(forces[near] * (found[near] - middle))) / square if square else None
    return Floor(estimate, pressed, len(calm), float(calm.std()), limit, slope, least)


def estimates(reading: Reading) -> dict[str, float]:
    """Return the numbers of a reading that mean a force, by name."""
    found: dict[str, float] = {}
    load, wrench = reading.get(RelativeLoad), reading.get(Wrench)
    if load is not None:
        found["load"] = load.load
    if wrench is not None:
        found |= {"fx": wrench.fx_n, "fy": wrench.fy_n, "fz": wrench.fz_n}
    if not found:
        raise InputError(
            "no step of the profile gives a force; add core.load or core.force_elastic to its "
            "estimators, and give the bundle that it needs"
        )
    return found


def floor_table(floors: Sequence[Floor]) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of a table."""
    header = ["estimate", "object", "least force", "noise at rest", "99 % within", "per newton"]
    rows = []
    for floor in floors:
        unit = "" if floor.estimate == "load" else " N"
        least = "none" if floor.least_n is None else f"{floor.least_n:.3f} N"
        slope = "–" if floor.slope_per_n is None else f"{floor.slope_per_n:.3g}{unit}"
        noise, limit = (f"{one:.2g}{unit}" for one in (floor.rest_std, floor.rest_limit))
        rows.append([floor.estimate, floor.object, least, noise, limit, slope])
    return header, rows


_SHEAR = "fx", "fy"


class VIRTUAL_FLOOR:
    """What is pressed on the virtual sensor."""

    # [count] Frames without force, and again before every shear. Source: by hand, the quantile is
    # then close to the largest of them.
    rest_frames = 60
    # [count] Frames whose mean is the reference of a sensor without a bundle. Source: that of
    # ``capture_reference``.
    averaged = 10
    # [N] Normal force while the surface is sheared. Source: by hand, : a light grip, with fifty
    # times the shear force in question.
    held_n = 1.0
    # [mm] Displacement of the object between two readings. Source: by hand, : less than a
    # hundredth of a newton on the fingertip.
    shear_mm = 0.004
    # [count] Readings while the surface is sheared. Source: by hand, to two tenths of a newton on
    # the fingertip.
    shears = 25
    # [N] Normal forces at which readings are taken. Source: by hand, : around the least force of
    # the review's table 1.
    forces_n: tuple[float, ...] = (0.01, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 1)


_OBJECTS: dict[str, tuple[str, dict[str, float]]] = {
    "sphere 12 mm": ("sphere", {"diameter_mm": 12}),
    "cylinder 10 mm": ("cylinder", {"diameter_mm": 10, "length_mm": 8}),
    "flat 6 mm": ("flat", {"diameter_mm": 6}),
}


def virtual_floors(
    profile: Profile,
    bundle: Bundle | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[Floor]:
    """Press and shear three objects on a virtual sensor.

    Normal force is judged against the undeformed surface; shear force against a contact that is
    pressed and not yet sheared.

    Parameters
    ----------
    profile : Profile
        Loaded for simulation; with steps that give a :class:`~tactile_core.Wrench` or a
        :class:`~tactile_core.RelativeLoad`.
    bundle : Bundle, optional
        Default: a virtual calibration, if a step gives a wrench.
    seed : int
        Of the unit and of its noise.

    Raises
    ------
    InputError
        No step gives a force.
    """
    progress = progress or Silent()
    trial = Trial(profile, bundle, seed, progress)
    rest = trial.readings(VIRTUAL_FLOOR.rest_frames)
    floors = []
    for number, (name, (kind, sizes)) in enumerate(_OBJECTS.items()):
        progress.stage(f"pressing and shearing a {name}", 0.25)
        trial.place(kind, sizes)
        pressed = [trial.press_object(force_n) for force_n in VIRTUAL_FLOOR.forces_n]
        found = [key for key in rest[0] if key not in _SHEAR]
        for key in found:
            calm = [one[key] for one in rest]
            forces = [true["fz"] for true, _ in pressed]
            floors.append(floor_of(key, name, calm, forces, [one[key] for _, one in pressed]))
        for key in _SHEAR if _SHEAR[0] in rest[0] else ():
            trial.place(kind, sizes)
            trial.press_object(VIRTUAL_FLOOR.held_n)
            calm = [one[key] for one in trial.readings(VIRTUAL_FLOOR.rest_frames // 2)]
            sheared = list(trial.shear_object(key))
            forces, readings = ([one[key] for one in side] for side in zip(*sheared, strict=True))
            floors.append(floor_of(key, name, calm, forces, readings))
        progress.fraction((number + 1) / len(_OBJECTS))
    return floors


class Trial:
    """A virtual sensor and its pipeline."""

    def __init__(
        self, profile: Profile, bundle: Bundle | None, seed: int, progress: Progress
    ) -> None:
        self._stage = VirtualStage(profile, seed)
        if bundle is None and Wrench in Pipeline(profile).gives:
            bundle = calibrated_virtually(profile, progress)
        progress.stage("reading without contact", 0.1)
        before = [self._stage.frame() for _ in range(VIRTUAL_FLOOR.averaged)]
        self._pipeline = Pipeline(profile, bundle, average(before))

    def place(self, kind: str, sizes: dict[str, float]) -> None:
        """Take another object, above the undeformed surface."""
        self._stage.reset()
        self._pipeline.reset()
        self._stage.indenter(kind, **sizes)
        self.readings(1)

    def readings(self, count: int) -> list[dict[str, float]]:
        """Estimates of so many frames."""
        return [estimates(self._pipeline.process(self._stage.frame())) for _ in range(count)]

    def press_object(self, force_n: float) -> tuple[dict[str, float], dict[str, float]]:
        """Press with a force; return true forces and estimates."""
        self._stage.press(force_n=force_n)
        return self._true(), self.readings(1)[0]

    def shear_object(self, key: str) -> Iterator[tuple[dict[str, float], dict[str, float]]]:
        """Shear step by step along the axis of this estimate."""
        way_mm = VIRTUAL_FLOOR.shear_mm * np.array([key == "fx", key == "fy"], np.float64)
        for _ in range(VIRTUAL_FLOOR.shears):
            self._stage.shear(dx_mm=float(way_mm[0]), dy_mm=float(way_mm[1]))
            yield self._true(), self.readings(1)[0]

    def _true(self) -> dict[str, float]:
        fx, fy, fz, _ = map(float, self._stage.truth().wrench)
        return {"fx": fx, "fy": fy, "fz": fz}


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
