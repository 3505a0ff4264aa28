"""Slopes of every pixel, and their standard errors."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import ONE_SIGMA
from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.algorithms.light.photometric import place, relative_change
from tactile_core.algorithms.slopes.colour_table import ColourTable
from tactile_core.algorithms.slopes.sampling import Sampling
from tactile_core.algorithms.slopes.slope_grid import (
    Model,
    PressLight,
    SlopeCells,
    SlopeGrid,
    averaged_for_heights,
)


class SlopeField:
    """A slope model prepared for one reference.

    Several threads may call its methods at once.

    Parameters
    ----------
    model : callable
        (N, K + 2) relative changes and position → (N, 2) x and y components of the unit normal.
    table : ColourTable or None
        The same model over the change alone; None to evaluate the model everywhere.
    reference : (H, W, K) float32
        Image of the undeformed sensor.
    reference_markers : (H, W) bool or None
        Pixels that show a marker in it.
    full_scale : float
        The intensity at which a channel saturates.
    blur_px : float
        Standard deviation of the smoothing.
    press_light : PressLight, optional
        Tilt that a press seems to give to level gel.
    """

    def __init__(
        self,
        model: Model,
        table: ColourTable | None,
        reference: Float32,
        reference_markers: Bool | None = None,
        *,
        full_scale: float = LEVELS.full_scale_8_bit,
        blur_px: float = 2.0,
        press_light: PressLight | None = None,
    ) -> None:
        self._model, self._table, self._press_light = model, table, press_light
        self._reference = reference, reference_markers
        self._full_scale = full_scale
        self._sampling = Sampling.for_shape(reference.shape[:2], reference_markers, blur_px)

    def measure(self, pixels: NDArray[Any], marker_mask: Bool | None = None) -> SlopeCells:
        """Measure the slopes of a frame, on a grid as coarse as their smoothing allows.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marker_mask : (H, W) bool, optional
            Pixels that show a marker. They get the slope of the gel surface around them.
        """
        return self._fine.measure(pixels, marker_mask)

    def for_heights(self, pixels: NDArray[Any], marker_mask: Bool | None = None) -> SlopeCells:
        """Measure the slopes of a frame on the grid to integrate them on; see :meth:`measure`.

        Where this grid is wider, colours are averaged and not slopes.
        """
        return self._wide.measure(pixels, marker_mask)

    @cached_property
    def _fine(self) -> SlopeGrid:
        return self._grid(self._sampling)

    @cached_property
    def _wide(self) -> SlopeGrid:
        sampling = self._sampling
        if sampling.step == 1 or not averaged_for_heights(sampling.shape):
            return self._fine
        return self._grid(sampling.wider())

    def _grid(self, sampling: Sampling) -> SlopeGrid:
        return SlopeGrid(
            self._model,
            self._table,
            *self._reference,
            sampling,
            self._full_scale,
            self._press_light,
        )


class Sampler:
    """Features of pixels as slope models take them: relative change and position."""

    def __init__(
        self,
        reference: Float32,
        reference_markers: Bool | None = None,
        *,
        full_scale: float = LEVELS.full_scale_8_bit,
        blur_px: float = 2.0,
    ) -> None:
        self._sampling = Sampling.for_shape(reference.shape[:2], reference_markers, blur_px)
        self._base = self._sampling.smooth_image(reference, reference_markers)
        self._place = place(reference.shape[:2])
        self._full_scale = full_scale

    def features(
        self,
        pixels: NDArray[Any],
        marker_mask: Bool | None,
        rows: NDArray[np.int32],
        columns: NDArray[np.int32],
    ) -> Float32:
        """Return (N, K + 2) features of N pixels of one frame."""
        smoothed = self._sampling.smooth_image(pixels, marker_mask)[rows, columns]
        base = self._base[rows, columns]
        change = relative_change(smoothed, base, full_scale=self._full_scale)
        return np.concatenate([change, self._place[rows, columns]], axis=1)


class ERRORS:
    """Parameters of the standard deviation of slopes. Nothing sets them from outside."""

    # [count] Neighbouring bins are merged until each holds as many pixels. Source: a hundred
    # values give the quantile within a tenth.
    min_samples = 100
    # [mm per mm] All smaller slopes share the lowest bin. Source: a fiftieth of a degree, far
    # below the noise of any sensor.
    least_slope = 3e-4
    # [px] Error of position of a feature of the surface. Where slopes vary, it is an error of
    # slope. Source: ``benchmarks/uncertainty.py`` on virtual indenters other than the ball.
    edge_px = 1.0


def error_table(slopes: Array, errors: Array) -> tuple[Float32, Float32]:
    """Tabulate the size of an error against the measured slope.

    Parameters
    ----------
    slopes : (N,) float
        Measured slopes: the length of the gradient, mm per mm.
    errors : (N, 2) float
        Measured minus true slopes, x and y.

    Returns
    -------
    slopes, std : (M,) float32
        Mean slope in each bin, and the standard deviation of a component there.
    """
    zero = slopes < ERRORS.least_slope
    if ERRORS.min_samples <= np.count_nonzero(zero) < len(slopes):
        # a model that ignores small changes may miss any slope up to the smallest that it returns
        # [share] Nearly the smallest slope that the model returns, but not a single pixel's
        missed = float(np.quantile(slopes[~zero], 0.02))
        errors = np.where(zero[:, None], np.maximum(np.abs(errors), missed), errors)
    order = np.argsort(slopes)
    slopes, size = slopes[order], np.abs(errors[order])
    steepest = max(float(slopes[-1]), 2 * ERRORS.least_slope)
    # [bins] errors vary smoothly with the slope
    edges = np.geomspace(ERRORS.least_slope, steepest, 18)
    starts = [0]
    for start in np.searchsorted(slopes, edges):
        if start - starts[-1] >= ERRORS.min_samples and len(slopes) - start >= ERRORS.min_samples:
            starts.append(int(start))
    bins = [slice(a, b) for a, b in zip(starts, [*starts[1:], len(slopes)], strict=True)]
    # not the root mean square, because errors have heavy tails
    std = [np.quantile(size[one], ONE_SIGMA) for one in bins]
    return (
        np.array([slopes[one].mean() for one in bins], np.float32),
        np.array(std, np.float32),
    )


def slope_std(
    gx: Float32, gy: Float32, slopes: Float32, std: Float32, *, step_px: int = 1
) -> Float32:
    """Return the standard deviation of a component of the slope, on a coarse grid.

    It is that of the slope's size in a table, plus what an error of position causes where the slope
    varies, for example at an edge.

    Parameters
    ----------
    gx, gy : (H, W) float32
        ∂z/∂x and ∂z/∂y.
    slopes, std : (M,) float32
        Result of :func:`error_table`.
    step_px : int
        Distance between neighbouring slopes.

    Returns
    -------
    (h, w) float32
        One value per cell; equal cells tile the image.
    """
    step = max(1, -(-max(gx.shape) // 160))  # [cells] for speed; standard deviations vary slowly
    size = max(1, gx.shape[1] // step), max(1, gx.shape[0] // step)
    # numpy rounds alike wherever an array lies in memory; OpenCV's magnitude does not
    x, y = (cv2.resize(g, size, interpolation=cv2.INTER_NEAREST) for g in (gx, gy))
    found = np.interp(np.hypot(x, y), slopes, std)
    variation = np.zeros(found.shape, np.float32)
    for g in (gx, gy):
        mean = cv2.resize(g, size, interpolation=cv2.INTER_AREA)
        across, down = (
            cv2.Sobel(mean, cv2.CV_32F, *order, ksize=1, borderType=cv2.BORDER_REPLICATE)
            for order in ((1, 0), (0, 1))
        )
        variation += np.hypot(across, down)
    # central differences span two cells
    edge = variation * (ERRORS.edge_px / (2 * step * step_px))
    return np.asarray(np.hypot(found, edge), np.float32)
