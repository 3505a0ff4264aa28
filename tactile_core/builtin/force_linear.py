"""Estimator ``core.force_linear``: force from a regression fitted to a unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float64, Intp
from tactile_core.algorithms.force.cell_axes import fitted_error
from tactile_core.algorithms.force.clock_offset import fitted_ridge
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.estimator import (
    COMPONENTS,
    FittedForce,
    ForceModel,
    ForceSamples,
    SensorContext,
)
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    FieldSpec,
    HeightMap,
    MarkerField,
    RelativeLoad,
    Wrench,
)
from tactile_core.quantities.wrench import UNKNOWN_LOAD

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


# [count] Columns of the grid on which a finer displacement field is averaged: means over the view
# do not depend on it, and it saves time
_MOST_CELLS = 96


class LinearForce(FittedForce):
    """Weighted sums of few physical features, fitted by ``tactile calibrate-force``.

    Shear force follows the mean displacement of the gel surface, as Yuan et al. found [1]_; torque
    follows its moment about the image centre; normal force follows its spread, the indented volume,
    the contact area and the relative load. The features are those of whatever the chain measures:
    every input is optional. The field of displacement is preferred to the markers.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan, E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA 2015.
    """

    feature_names = FEATURES

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._zero, self._last = np.zeros(4), np.zeros(4)

    def reset(self) -> None:
        """Forget the tare."""
        self._zero, self._last = np.zeros(4), np.zeros(4)

    def tare(self, result: Wrench) -> Wrench:
        """Subtract the present load from all later ones."""
        self._zero = self._last
        return Wrench.from_values(np.zeros(4), result.std, result.timestamp_s)

    def fit(self, sequences: Sequence[ForceSamples]) -> LinearForceModel:
        """Fit the model."""
        return fitted_linear_model(sequences)

    def estimate(
        self,
        model: LinearForceModel,
        displacement: DisplacementField | None,
        markers: MarkerField | None,
        contact: ContactMask | None,
        height: HeightMap | None,
        load: RelativeLoad | None,
    ) -> Wrench:
        """Return the load; 0 with a very large standard deviation where it was not fitted."""
        given = displacement, markers, contact, height, load
        found, std = model.forces(self.features(*given)[None])
        self._last = np.nan_to_num(found[0])
        times = [one.timestamp_s for one in given if one is not None]
        deviation = np.where(np.isfinite(std[0]), std[0], UNKNOWN_LOAD)
        return Wrench.from_values(self._last - self._zero, deviation, times[0] if times else 0.0)

    def features(
        self,
        displacement: DisplacementField | None,
        markers: MarkerField | None,
        contact: ContactMask | None,
        height: HeightMap | None,
        load: RelativeLoad | None,
    ) -> Float64:
        """(K,) float64: the features in the order of ``FEATURES``; NaN if they are unknown."""
        found: dict[str, float] = {}
        if displacement is not None:
            found |= _of_field(displacement, contact)
        elif markers is not None:
            found |= _of_markers(markers, contact)
        if contact is not None:
            found["area"] = contact.area_mm2
        if height is not None:
            found |= _of_height(height, contact)
        if load is not None:
            size = max(load.load, 0.0)
            found |= {"load": load.load, "load_square": size**2, "load_root": size**0.5}
        return np.array([found.get(name, np.nan) for name in FEATURES])


def _of_field(displacement: DisplacementField, contact: ContactMask | None) -> dict[str, float]:
    cells = displacement.cells_mm
    rows, columns = cells.shape[:2]
    if columns > _MOST_CELLS:
        rows = max(1, round(rows * _MOST_CELLS / columns))
        columns = _MOST_CELLS
        cells = shrink_image(cells, (columns, rows))
    cell_mm = displacement.valid.shape[1] / columns * displacement.mm_per_px
    y, x = np.indices((rows, columns), np.float64)
    places = np.stack([x - (columns - 1) / 2, y - (rows - 1) / 2], -1) * cell_mm
    valid = _on_cells(displacement.valid, (columns, rows))
    touching = None if contact is None else _on_cells(contact.mask, (columns, rows))[valid]
    return _of_vectors(places[valid], cells[valid], touching, cell_mm**2)


def _of_markers(markers: MarkerField, contact: ContactMask | None) -> dict[str, float]:
    size = None if contact is None else contact.mask.shape
    undeformed = markers.reference_px if markers.undeformed_px is None else markers.undeformed_px
    middle = undeformed.mean(0) if size is None else np.array([size[1] - 1, size[0] - 1]) / 2
    places = (undeformed - middle) * markers.mm_per_px
    touching = None
    if contact is not None and size is not None:
        column, row = np.rint(markers.px).astype(np.intp).T
        inside = (column >= 0) & (row >= 0) & (column < size[1]) & (row < size[0])
        touching = inside.copy()
        touching[inside] = contact.mask[row[inside], column[inside]]
    each_mm2 = float(np.prod(np.ptp(places, axis=0))) / max(len(places), 1)
    return _of_vectors(places, markers.displacement_mm, touching, each_mm2)


def _of_vectors(
    places: Array, moved: Array, touching: Bool | None, each_mm2: float
) -> dict[str, float]:
    """Features of displacements at places in mm, each of which stands for an area."""
    names = ("shift_x", "shift_y", "moment", "divergence", "spread", "shear")
    if not len(moved):
        return dict.fromkeys(names, 0.0)
    moved, places = moved.astype(np.float64), np.asarray(places, np.float64)
    mean = moved.mean(0)
    away = places - places.mean(0)
    found = {
        "shift_x": float(mean[0]),
        "shift_y": float(mean[1]),
        "moment": float((places[:, 0] * moved[:, 1] - places[:, 1] * moved[:, 0]).mean()),
        "divergence": float((away * moved).sum(1).mean()),
        "spread": float(np.sqrt(((moved - mean) ** 2).sum(1).mean())),
        "shear": float(np.hypot(*mean)),
    }
    if touching is not None:
        there, at = moved[touching] * each_mm2, places[touching]
        total = there.sum(0)
        centre = at.mean(0) if len(at) else np.zeros(2)
        found |= {
            "contact_shift_x": float(total[0]),
            "contact_shift_y": float(total[1]),
            "contact_moment": float((at[:, 0] * there[:, 1] - at[:, 1] * there[:, 0]).sum()),
            "lever": float(centre[0] * mean[1] - centre[1] * mean[0]),
        }
    return found


def _of_height(height: HeightMap, contact: ContactMask | None) -> dict[str, float]:
    mm, px = np.maximum(height.mm, 0), height.mm_per_px
    if contact is not None:
        mm = np.where(contact.mask, mm, 0)
    volume = float(mm.sum()) * px**2
    rows, columns = mm.shape
    x_mm = (np.arange(columns) - (columns - 1) / 2) * px
    y_mm = (np.arange(rows) - (rows - 1) / 2) * px
    return {
        "volume": volume,
        "volume_x": float(mm.sum(0) @ x_mm) * px**2,
        "volume_y": float(mm.sum(1) @ y_mm) * px**2,
        "depth": float(np.sqrt((mm**2).sum())) * px,
    }


def _on_cells(mask: Bool, size: tuple[int, int]) -> Bool:
    return np.asarray(shrink_image(mask.astype(np.float32), size) > 0.5)
