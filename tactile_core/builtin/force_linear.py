"""Estimator ``core.force_linear``: force from a regression fitted to a unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float64
from tactile_core.builtin.linear_force_model import (
    FEATURES,
    LinearForceModel,
    fitted_linear_model,
)
from tactile_core.interfaces.estimator import FittedForce, ForceSamples, SensorContext
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    HeightMap,
    MarkerField,
    RelativeLoad,
    Wrench,
)

# [count] Columns of the grid on which a finer displacement field is averaged: means over the view
# do not depend on it, and it saves time
_MOST_CELLS = 96


UNKNOWN = 1e6  # Standard deviation in N or N·mm of a component that was not fitted, and is 0


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
        deviation = np.where(np.isfinite(std[0]), std[0], UNKNOWN)
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
