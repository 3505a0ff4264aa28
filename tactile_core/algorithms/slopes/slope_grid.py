"""The grid that slope models compute on, the cells of its samples, and the light of a press."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression
from tactile_core.algorithms.arrays.shrinking import coarse_size, interpolate_cells, shrink_image
from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.algorithms.light.photometric import place, planes_to_gradient, to_normal_xy
from tactile_core.algorithms.slopes.colour_table import ColourTable
from tactile_core.algorithms.slopes.sampling import Sampling

# Heights are integrated from means over 2 × 2 cells where so many are left. Source: chosen by hand:
# a grid of 160 × 120, on which contacts are found, too (ADR 84).
HEIGHT_CELLS = 160 * 120

PLACE_ORDER = 2  # Order of the tilt in the position, that of the models it belongs to

# [sine of the slope angle] Steeper pixels count as sloped: above noise and apparent tilt of level
# gel
_STEEP_SINE = 0.1


@dataclass(frozen=True, eq=False)
class PressLight:
    """Tilt that level gel seems to have while something is pressed into it.

    Light is guided along the gel, so that a press changes the brightness far beyond its contact,
    differently for each light. A slope model mistakes the change for a tilt that varies smoothly
    over the view. An undeformed gel shows none of it, and a frame with fewer slopes than a
    calibration frame shows less.

    Attributes
    ----------
    tilt : (2, 6) float32
        What to add to the components x and y of the normal, as polynomials of the position.
    steep_share : float
        Mean share of sloped pixels in the calibration frames.
    """

    tilt: Float32
    steep_share: float

    def strength(self, normal_xy: NDArray[Any]) -> np.float32:
        """Return the share of the tilt, 0 to 1, in a frame with these normals, (2, h, w)."""
        step = max(1, min(normal_xy.shape[1:]) // 60)  # about 60 rows are as good as all
        share = steep_share(normal_xy[:, step // 2 :: step, step // 2 :: step])
        return np.float32(min(1.0, share / self.steep_share) if self.steep_share else 0.0)

    def tilt_at(self, position: Float32) -> Float32:
        """Return the full tilt (2, N) at (N, 2) positions."""
        return np.asarray(self.tilt @ regression.terms(position, PLACE_ORDER).T, np.float32)

    def tilt_over(self, shape: tuple[int, int]) -> Float32:
        """Return the full tilt (2, h, w) over a grid of this shape."""
        return self.tilt_at(place(shape).reshape(-1, 2)).reshape(2, *shape)


def steep_share(normal_xy: NDArray[Any]) -> float:
    """Return the share of sloped pixels among normals (2, ...)."""
    return float(((normal_xy**2).sum(axis=0) > _STEEP_SINE**2).mean())


class SlopeCells(NamedTuple):
    """Slopes on a grid that is as coarse as their smoothing, or what is done with them, allows.

    Attributes
    ----------
    gx, gy : (h, w) float32
        ∂z/∂x and ∂z/∂y at the centres of the cells, dimensionless.
    step_px : int
        Side of a cell. The last cells may reach beyond the image.
    as_normals : bool
        Whether unit normals are interpolated between the cells, or slopes. A model is best
        interpolated in what it computes.
    averaged : bool
        Whether the cells are wider than the smoothing allows, so that they hold means over four
        smaller ones.
    """

    gx: Float32
    gy: Float32
    step_px: int
    as_normals: bool = True
    averaged: bool = False

    def for_heights(self) -> SlopeCells:
        """Return the slopes on the grid to integrate them on.

        Heights are smoother than slopes, so means over 2 × 2 cells suffice where these are small.
        """
        if self.averaged or self.step_px == 1 or not averaged_for_heights(self.gx.shape):
            return self
        rows, columns = self.gx.shape
        gx, gy = (shrink_image(plane, (columns // 2, rows // 2)) for plane in (self.gx, self.gy))
        return SlopeCells(gx, gy, 2 * self.step_px, self.as_normals, averaged=True)

    def image(self, shape: tuple[int, int]) -> tuple[Float32, Float32]:
        """Return the slopes of every pixel of an (H, W) image."""
        if self.step_px == 1:
            return self.gx, self.gy
        if not self.as_normals:
            gx, gy = (interpolate_cells(plane, self.step_px, shape) for plane in (self.gx, self.gy))
            return gx, gy
        normal_xy = to_normal_xy(np.stack([self.gx, self.gy], axis=-1))
        gx, gy = (interpolate_cells(normal_xy[..., k], self.step_px, shape) for k in (0, 1))
        planes_to_gradient(gx, gy)
        return gx, gy


def averaged_for_heights(shape: tuple[int, ...]) -> bool:
    """Whether heights are integrated from means over 2 × 2 cells of an (h, w) grid of slopes."""
    rows, columns = shape
    return rows % 2 == columns % 2 == 0 and rows * columns >= 4 * HEIGHT_CELLS


Model = Callable[[Float32], Float32]


# [count] About so many cells are computed together: what a model makes stays in cache
_BLOCK = 8_192


class SlopeGrid:
    """A slope model prepared for one reference on one grid.

    With a table, the model is evaluated at a few points, and the table between them. Several
    threads may call :meth:`measure` at once.

    Parameters
    ----------
    model : callable
        (N, K + 2) relative changes and position → (N, 2) x and y components of the unit normal.
    table : ColourTable or None
        The same model over the change alone; None evaluates the model in every cell.
    reference : (H, W, K) float32
        Image of the undeformed sensor.
    reference_markers : (H, W) bool or None
        Pixels that show a marker in it.
    sampling : Sampling
        Smooths an image to the grid.
    full_scale : float
        The intensity at which a channel saturates.
    press_light : PressLight, optional
        Tilt that a press seems to give to level gel.
    """

    def __init__(
        self,
        model: Model,
        table: ColourTable | None,
        reference: Float32,
        reference_markers: Bool | None,
        sampling: Sampling,
        full_scale: float = LEVELS.full_scale_8_bit,
        press_light: PressLight | None = None,
    ) -> None:
        self._model, self._table, self._sampling = model, table, sampling
        # About so many points suffice on recorded three-colour balls (ADR 6)
        points = sampling.shape[0] * sampling.shape[1] if table is None else 1_200
        self._coarse = coarse_size(*sampling.shape, points)
        base = np.asarray(sampling.smooth(reference, reference_markers), np.float32)
        floor = np.float32(LEVELS.least_divisor_share * full_scale)
        self._base = np.maximum(self._average_cells(base), floor).reshape(-1, base.shape[2])
        self._place = self._average_cells(place(sampling.shape)).reshape(-1, 2)
        if table is not None:
            self._entries_per_level = np.float32(table.axis.per_unit) / np.maximum(base, floor)
        self._press_light = press_light
        if press_light is not None:
            self._tilt = press_light.tilt_over(sampling.shape)

    def measure(self, pixels: NDArray[Any], marker_mask: Bool | None = None) -> SlopeCells:
        """Measure the slopes of a frame.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marker_mask : (H, W) bool, optional
            Pixels that show a marker. They get the slope of the gel surface around them.
        """
        sampling = self._sampling
        smoothed = sampling.smooth(pixels, marker_mask)
        normal_xy = self._from_model(self._average_cells(smoothed))
        if self._table is not None:
            normal_xy = self._between_points(normal_xy, self._look_up(self._table, smoothed))
        if self._press_light is not None:
            normal_xy += self._press_light.strength(normal_xy) * self._tilt
        gx, gy = normal_xy
        planes_to_gradient(gx, gy)
        return SlopeCells(gx, gy, sampling.step, averaged=sampling.averaged)

    def _average_cells(self, image: NDArray[Any]) -> Float32:
        """Average an image over the cells of the coarse grid, in float32."""
        return np.asarray(
            shrink_image(image.astype(np.float32, copy=False), self._coarse), np.float32
        )

    def _from_model(self, colours: Float32) -> Float32:
        """Evaluate the model on the coarse grid, (2, h, w)."""
        change = colours.reshape(self._base.shape) / self._base - np.float32(1)
        features = np.concatenate([change, self._place], axis=1)
        blocks = np.array_split(features, 1 + len(features) // _BLOCK)
        found = np.concatenate([self._model(block) for block in blocks])
        return np.ascontiguousarray(found.T).reshape(2, *colours.shape[:2])

    def _look_up(self, table: ColourTable, smoothed: NDArray[Any]) -> Float32:
        """Return the table's entry for each cell, (2, h, w)."""
        h, w = smoothed.shape[:2]
        count = table.axis.count
        ratio = cv2.multiply(smoothed, self._entries_per_level, dtype=cv2.CV_8U)
        # On a single channel the subtraction takes a scalar and saturates at the first entry.
        rows = np.asarray(ratio).reshape(h, -1)
        cv2.subtract(rows, np.array([table.axis.first], float), dst=rows)
        cv2.min(rows, np.array([table.axis.last], float), dst=rows)
        # numbers of entries are exact in float32
        strides = np.array([[count * count, count, 1]], np.float32)
        bins = rows.reshape(h, w, 3).astype(np.float32)
        entry = np.asarray(cv2.transform(bins, strides)).astype(np.intp)
        found = table.normal_xy.reshape(-1).take(entry, mode="clip")
        normal_xy = np.empty((2, h, w), np.float32)
        cv2.split(found.view(np.float32).reshape(h, w, 2), list(normal_xy))
        return normal_xy

    def _between_points(self, exact: Float32, normal_xy: Float32) -> Float32:
        """Add to ``normal_xy`` what it lacks at the points of the coarse grid, interpolated."""
        for plane, coarse in zip(normal_xy, exact, strict=True):
            missing = coarse - self._average_cells(plane)
            wide = cv2.resize(missing, plane.shape[::-1], interpolation=cv2.INTER_LINEAR)
            cv2.add(plane, wide, dst=plane)
        return normal_xy
