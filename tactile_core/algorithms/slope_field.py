"""Slopes of a whole image from a model of relative change and position.

On small images, and on images of other than three channels, the model is evaluated at every pixel;
on others by :mod:`tactile_core.algorithms.slope_grid`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.algorithms.colour_table import ColourTable
from tactile_core.algorithms.levels import LEVELS
from tactile_core.algorithms.photometric import Smoothing, place, relative_change, to_gradient
from tactile_core.algorithms.sampling import Sampling
from tactile_core.algorithms.slope_grid import Model, SlopeCells, SlopeGrid, averaged_for_heights

# On images up to this size the model is evaluated at every pixel. Source: chosen by hand; no script
# derives it.
EXACT_PIXELS = 20_000


def takes_table(shape: tuple[int, int, int]) -> bool:
    """Whether (H, W, K) images have three channels and are large enough for the lookup table."""
    return shape[2] == 3 and shape[0] * shape[1] > EXACT_PIXELS


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
    ) -> None:
        self._model = model
        self._table = table if takes_table(reference.shape) else None
        self._reference = reference, reference_markers
        self._full_scale = full_scale
        self._blur_px = blur_px
        self._sampling = Sampling.for_shape(reference.shape[:2], reference_markers, blur_px)

    def measure(self, pixels: NDArray[Any], marker_mask: Bool | None = None) -> SlopeCells:
        """Measure the slopes of a frame, on a grid as coarse as their smoothing allows.

        Parameters
        ----------
        pixels : (H, W, K) uint8, uint16 or float32
        marker_mask : (H, W) bool, optional
            Pixels that show a marker. They get the slope of the gel surface around them.
        """
        if self._table is not None:
            return self._fine.measure(pixels, marker_mask)
        every = self._sampler.image(pixels, marker_mask)
        both = to_gradient(self._model(every.reshape(-1, every.shape[2])))
        gx, gy = np.ascontiguousarray(both.reshape(*every.shape[:2], 2).transpose(2, 0, 1))
        return SlopeCells(gx, gy, step_px=1)

    def for_heights(self, pixels: NDArray[Any], marker_mask: Bool | None = None) -> SlopeCells:
        """Measure the slopes of a frame on the grid to integrate them on; see :meth:`measure`.

        Where this grid is wider, colours are averaged and not slopes.
        """
        return (self._wide or self).measure(pixels, marker_mask)

    @cached_property
    def _sampler(self) -> Sampler:
        return Sampler(*self._reference, full_scale=self._full_scale, blur_px=self._blur_px)

    @cached_property
    def _fine(self) -> SlopeGrid:
        return self._grid(self._sampling)

    @cached_property
    def _wide(self) -> SlopeGrid | None:
        sampling = self._sampling
        if self._table is None or sampling.step == 1 or not averaged_for_heights(sampling.shape):
            return None
        return self._grid(sampling.wider())

    def _grid(self, sampling: Sampling) -> SlopeGrid:
        assert self._table is not None
        return SlopeGrid(self._model, self._table, *self._reference, sampling, self._full_scale)


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
        self._smoothing = Smoothing.from_sigma(reference_markers, blur_px)
        self._base = np.asarray(self._smoothing.apply(reference, reference_markers), np.float32)
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
        return self.image(pixels, marker_mask)[rows, columns]

    def image(self, pixels: NDArray[Any], marker_mask: Bool | None) -> Float32:
        """Return (H, W, K + 2) features of all pixels of one frame."""
        smoothed = self._smoothing.apply(pixels, marker_mask)
        change = relative_change(smoothed, self._base, full_scale=self._full_scale)
        return np.concatenate([change, self._place], axis=2)
