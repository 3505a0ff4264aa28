"""Statistics of readings near zero force: noise, slope and the least force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.errors import InputError
from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import RelativeLoad, Wrench


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
