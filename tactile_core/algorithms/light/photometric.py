"""Photometric measures: relative change, surroundings of markers, background, unit normals."""

from __future__ import annotations

from functools import cached_property
from math import comb
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import sigma_of, terms
from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Float32, from_middle
from tactile_core.algorithms.light.drift import LEVELS


def planes_of(pixels: NDArray[Any]) -> list[NDArray[Any]]:
    """Return the channels of an (H, W, K) image as contiguous planes, views where they are."""
    planar = pixels.transpose(2, 0, 1)
    return list(planar if planar.flags.c_contiguous else np.ascontiguousarray(planar))


def bare_mask(marker_mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return (H, W) uint8: 255 where no marker hides the gel surface, else 0."""
    # less than half the time of a comparison: 0 − 1 is 255
    return np.subtract(marker_mask.view(np.uint8), np.uint8(1))


class AroundMarkers:
    """Fills the markers of one frame, up to four channels at a time.

    Parameters
    ----------
    surface : (H, W) uint8
        From :func:`bare_mask`.
    size_px : int
        Side of the neighbourhood that markers are filled from.
    """

    def __init__(self, surface: NDArray[np.uint8], size_px: int) -> None:
        self._surface = surface
        rows, columns = surface.shape
        # The mean around a marker varies slowly, so a coarser image suffices. Halving is by far
        # the fastest way to make one.
        step = 1
        # a neighbourhood stays at least six cells wide
        while 12 * step <= size_px and rows % (2 * step) == columns % (2 * step) == 0:
            step *= 2
        self._coarse = max(1, columns // step), max(1, rows // step)
        self._side = max(3, size_px // step) | 1

    @cached_property
    def _count(self) -> Float32:
        """Number of bare pixels in the neighbourhood of each."""
        counts = np.asarray(self._total(self._surface), np.float32)
        counts /= np.float32(255)
        return np.maximum(counts, np.float32(1e-3), out=counts)  # no division by zero

    def fill_part(self, part: NDArray[Any]) -> NDArray[Any]:
        """Return (H, W), or up to four channels (H, W, K), with the markers filled; same dtype."""
        without = np.zeros_like(part)
        cv2.copyTo(part, self._surface, without)
        total = self._total(without)
        count = self._count if part.ndim == 2 else cv2.merge([self._count] * part.shape[2])
        around = cv2.divide(total, count, dtype=cv2.CV_8U if part.dtype == np.uint8 else -1)
        if part.dtype == np.uint16:
            around = np.rint(around).astype(np.uint16)
        filled = cv2.resize(around, part.shape[1::-1], interpolation=cv2.INTER_LINEAR)
        cv2.copyTo(part, self._surface, filled)
        return np.asarray(filled)

    def _total(self, part: NDArray[Any]) -> Float32:
        small = shrink_image(part, self._coarse)
        size = self._side, self._side
        # sums of bytes are exact, and means are not
        return np.asarray(cv2.boxFilter(small, cv2.CV_32F, size, normalize=False), np.float32)


def around_markers(marker_mask: NDArray[np.bool_] | None) -> int:
    """Side in px of a neighbourhood that extends beyond most markers; 0 without markers."""
    if marker_mask is None or not marker_mask.any():
        return 0
    _, _, boxes, _ = cv2.connectedComponentsWithStats(marker_mask.view(np.uint8))
    sides = np.asarray(boxes)[1:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1]
    return int(np.median(sides.max(axis=1))) * 2 + 1  # [px] two diameters and a pixel


def relative_change(
    smoothed: NDArray[Any], base: Float32, *, full_scale: float = LEVELS.full_scale_8_bit
) -> Float32:
    """Relative change (I − I₀) / I₀ of each channel.

    Unlike the plain difference I − I₀, the ratio does not depend on how brightly each light
    illuminates each place. On recorded balls it removes most of the error that depends on the
    position in the image.

    Parameters
    ----------
    smoothed : (..., K)
        Intensities I of the frame.
    base : (..., K) float32
        Intensities I₀ of the reference.
    full_scale : float
        The intensity at which a channel saturates.

    Returns
    -------
    (..., K) float32
        0 where nothing changed, −1 where no light is left.
    """
    floor = np.float32(LEVELS.least_divisor_share * full_scale)
    return np.asarray(smoothed / np.maximum(base, floor) - np.float32(1), np.float32)


def place(shape: tuple[int, int]) -> Float32:
    """Position of each pixel, (H, W, 2): x and y from the centre, in half widths of the image."""
    y, x = (from_middle(side) / (shape[1] / 2) for side in shape)
    return np.stack(np.broadcast_arrays(x, y[:, None]), -1).astype(np.float32)


_ROUNDS = 8  # [count] Reweightings at the final degree, and at each degree below it
_FIRST_ROUNDS = 4
# [logarithm of intensity] Smallest residual scale of the Cauchy weights: the noise of the coating:
# chosen on the six-LED groove recording, where widths of 0.01 to 0.1 give the same heights (ADR 14)
_LEAST_SIGMA = 0.03


def smooth_background(
    pixels: NDArray[Any], marker_mask: NDArray[np.bool_] | None = None, *, degree: int = 4
) -> Float32:
    """Estimate the illumination of a flat, undeformed gel surface from an image with relief.

    Fits a polynomial of the position to the logarithm of each channel by iteratively reweighted
    least squares with Cauchy weights [1]_, so that relief has almost no weight. The result keeps
    only what varies as slowly as the polynomial: a shape that fills the image is mistaken for
    illumination.

    Parameters
    ----------
    pixels : (H, W, K)
        Intensities; most of the gel surface should be flat.
    marker_mask : (H, W) bool, optional
        Pixels that do not show the coating.
    degree : int
        Total degree of the polynomial.

    Returns
    -------
    (H, W, K) float32
        In the units of ``pixels``, positive.

    References
    ----------
    .. [1] P. W. Holland and R. E. Welsch, "Robust regression using iteratively reweighted
       least-squares", Communications in Statistics – Theory and Methods 6(9), 1977.
    """
    height, width, channels = pixels.shape
    step = max(1, min(height, width) // 160)  # [samples] more add no accuracy
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    powers = terms(np.stack([x.ravel(), y.ravel()], axis=1), degree)
    seen = np.zeros((height, width), bool)
    seen[step // 2 :: step, step // 2 :: step] = True
    if marker_mask is not None:
        seen &= ~marker_mask
    sampled = powers[seen.ravel()]
    least = max(float(pixels.max()) / 1000, 1e-6)
    planes = []
    for k in range(channels):
        logarithm = np.log(np.maximum(pixels[..., k][seen].astype(np.float64), least))
        planes.append(np.exp(powers @ _cauchy_fit(sampled, logarithm, degree)))
    return np.stack(planes, axis=1).reshape(pixels.shape).astype(np.float32)


def _cauchy_fit(powers: NDArray[Any], values: NDArray[Any], degree: int) -> NDArray[Any]:
    """Fit the coefficients, one degree after another.

    Each degree starts from the weights of the one below. A low degree is too stiff to follow
    relief, so its outliers stay outliers, even near the border.
    """
    weight = np.ones_like(values)
    coefficients: NDArray[Any] = np.zeros(0)
    for highest in range(degree + 1):
        lower = powers[:, : comb(highest + 2, 2)]
        for _ in range(_ROUNDS if highest == degree else _FIRST_ROUNDS):
            root = np.sqrt(weight)
            coefficients = np.linalg.lstsq(lower * root[:, None], values * root, rcond=None)[0]
            residual = values - lower @ coefficients
            sigma = max(_LEAST_SIGMA, sigma_of(residual))
            weight = 1 / (1 + np.square(residual / sigma))
    return coefficients


# [ratio] Largest length of the x and y components that slope models return: the sine of 78.5°.
# Steeper normals keep their direction. Stored models and their tables are made with it.
STEEPEST_SINE = 0.98


def to_normal_xy(gradients: Float32) -> Float32:
    """Components of unit normals from (..., 2) slopes."""
    norm = np.sqrt(1 + (gradients * gradients).sum(-1, keepdims=True))
    return np.asarray(gradients / norm, np.float32)


def planes_to_gradient(nx: Float32, ny: Float32) -> None:
    """Convert two planes of normal components to slopes in place.

    Parameters
    ----------
    nx, ny : (H, W) float32
        Components of the unit normals; overwritten by the slopes.
    """
    square = np.asarray(cv2.multiply(nx, nx), np.float32)
    cv2.accumulateSquare(ny, square)
    # Finding the maximum is much faster than a mask, and few images have a pixel that is too steep.
    if cv2.minMaxLoc(square)[1] > STEEPEST_SINE**2:
        steep = np.nonzero(square > STEEPEST_SINE**2)
        shrink = np.float32(STEEPEST_SINE) / np.sqrt(square[steep])
        nx[steep] *= shrink
        ny[steep] *= shrink
        square[steep] = STEEPEST_SINE**2
    per_cosine = cv2.pow(cv2.addWeighted(square, -1.0, square, 0.0, 1.0), -0.5)
    cv2.multiply(nx, per_cosine, dst=nx)
    cv2.multiply(ny, per_cosine, dst=ny)
