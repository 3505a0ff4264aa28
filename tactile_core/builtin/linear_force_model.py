"""Force as weighted sums of few physical features, and their fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float64, Intp
from tactile_core.algorithms.force_fit.cell_axes import fitted_error
from tactile_core.algorithms.force_fit.clock_offset import fitted_ridge
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.estimator import COMPONENTS, ForceModel, ForceSamples
from tactile_core.quantities import FieldSpec

# Features that change sign with the direction of the shear.
LATERAL = (
    "shift_x",
    "shift_y",
    "contact_shift_x",
    "contact_shift_y",
    "volume_x",
    "volume_y",
)

# Features that change sign with the direction of the torque.
TURNING = ("moment", "contact_moment", "lever")

# Features that grow with the normal force.
PRESSING = ("divergence", "spread", "shear", "area", "volume", "depth", "load_root")

# The relative load and its square, which grow with the normal force too.
LOAD = ("load", "load_square")

FEATURES = (*LATERAL, *TURNING, *PRESSING, *LOAD)  # The features of a frame, in order

_LOADS = (*LOAD, "load_root")
_SHEAR = (LATERAL[:2], LATERAL[2:4], LATERAL[:4], LATERAL)
_PRESSURE = (*((name,) for name in PRESSING[:-1]), ("divergence", "spread", "shear"), PRESSING[3:6])
# Sets of features that each component may depend on: those with its symmetry.
_CANDIDATES = (
    _SHEAR,
    _SHEAR,
    (*_PRESSURE, _LOADS, PRESSING[:-1], (*PRESSING, *LOAD)),
    (("moment",), ("contact_moment",), TURNING, (*TURNING, *LATERAL)),
)

_FILE = "force.npz"


@dataclass(frozen=True, eq=False)
class LinearForceModel(ForceModel):
    """Force as weighted sums of features.

    Attributes
    ----------
    weights : (4, K) float64
        N or N·mm per unit of each of :data:`FEATURES`, one row per component; a row of NaN if the
        component was not fitted.
    errors : (4, 2) float64
        Standard deviation of each component at rest, and its growth with the load.
    used : (K,) bool
        The features that the fit had.
    """

    weights: Annotated[Float64, FieldSpec("N or N·mm", ("component", "feature"))]
    errors: Annotated[Float64, FieldSpec("N or N·mm", ("component", "part"))]
    used: Annotated[Bool, FieldSpec("", ("feature",))]

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(FEATURES)
        shapes = self.weights.shape, self.errors.shape, self.used.shape
        if shapes != ((4, count), (4, 2), (count,)):
            raise CalibrationError(
                "a linear force model needs the weights of each component and feature"
            )
        fitted = np.isfinite(self.weights).all(1)
        if not fitted.any() or not (np.isfinite(self.errors[fitted]).all()):
            raise CalibrationError("a linear force model needs finite weights")

    def forces(self, features: Float64) -> tuple[Float64, Float64]:
        """Predict forces; see :meth:`ForceModel.forces`."""
        absent = self.used & ~np.isfinite(features).all(0)
        if absent.any():
            names = [name for name, missing in zip(FEATURES, absent, strict=True) if missing]
            raise InputError(
                f"the force model was fitted with {', '.join(names)}, which this chain does not "
                f"measure; restore its steps, or run 'tactile calibrate-force' again"
            )
        known = np.where(self.used, features, 0)
        found = known @ self.weights.T
        load = np.sqrt(np.nansum(found[:, :3] ** 2, axis=1))
        std = np.hypot(self.errors[:, 0], self.errors[:, 1] * load[:, None])
        return found, np.where(np.isfinite(found), std, np.nan)

    def save(self, directory: Path) -> None:
        """Write ``force.npz``."""
        arrays = {"weights": self.weights, "errors": self.errors, "used": self.used}
        write_npz(directory / _FILE, {**arrays, "features": np.array(FEATURES)})

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``force.npz``.

        Raises
        ------
        CalibrationError
            The file is missing, damaged or of another version.
        """
        path = directory / _FILE
        try:
            arrays = read_npz(path)
            if tuple(map(str, arrays["features"])) != FEATURES:
                raise ValueError("other features")
            weights, errors = (np.asarray(arrays[n], np.float64) for n in ("weights", "errors"))
            return cls(weights, errors, np.asarray(arrays["used"], np.bool_))
        except (CalibrationError, InputError, ValueError, LookupError, TypeError) as error:
            raise CalibrationError(
                f"{path} does not hold a linear force model of this version; run "
                f"'tactile calibrate-force' again"
            ) from error


def fitted_linear_model(sequences: Sequence[ForceSamples]) -> LinearForceModel:
    """Fit a model: a ridge regression of each component on features with its symmetry.

    The set of features, penalties and standard deviations come from sequences that a regression
    was not fitted on.

    Raises
    ------
    CalibrationError
        No feature or no force was measured.
    """
    features = np.concatenate([one.features for one in sequences])
    forces = np.concatenate([one.forces for one in sequences])
    number = np.repeat(np.arange(len(sequences)), [len(one.features) for one in sequences])
    used = np.isfinite(features).all(0)
    if not used.any():
        raise CalibrationError(
            "no frame has a quantity that the force could be fitted to: the force step needs a "
            "displacement, a contact, a height or a load"
        )
    weights = np.full((4, len(FEATURES)), np.nan)
    held_out = np.full_like(forces, np.nan)
    for component in range(4):
        known = np.isfinite(forces[:, component])
        force, least = forces[known, component], np.inf
        for columns, rising in _candidates(component, used) if known.any() else ():
            given = features[np.ix_(known, columns)]
            found = fitted_ridge(given, force, number[known], rising=rising)
            error = float(((found.held_out - force) ** 2).sum())
            if error < least:
                least = error
                weights[component] = 0
                weights[component, columns] = found.weights
                held_out[known, component] = found.held_out
    if np.isnan(weights).all():
        raise CalibrationError(
            f"no measured force can be fitted to the quantities that there are; give at least one "
            f"of {', '.join(COMPONENTS)} that the chain's steps respond to"
        )
    load = np.sqrt(np.nansum(held_out[:, :3] ** 2, axis=1))
    errors = np.full((4, 2), np.nan)
    for component in map(int, np.flatnonzero(np.isfinite(weights).all(1))):
        known = np.isfinite(held_out[:, component])
        misses = held_out[known, component] - forces[known, component]
        errors[component] = fitted_error(misses, load[known])
    return LinearForceModel(weights, errors, used)


def _candidates(component: int, used: Bool) -> Iterator[tuple[Intp, bool]]:
    """Yield sets of measured features for a component, and whether the force rises with each."""
    seen = set[tuple[str, ...]]()
    for names in _CANDIDATES[component]:
        there = tuple(name for name in names if used[FEATURES.index(name)])
        if there and there not in seen:
            seen.add(there)
            columns = np.array([FEATURES.index(name) for name in there], np.intp)
            yield columns, set(there) <= set(_LOADS)
