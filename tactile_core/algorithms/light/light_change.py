"""The change of light from a reference, and the area that is lit."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, lgamma, sqrt
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float32


class LightChangeParameters(NamedTuple):
    """Parameters of the load. Nothing sets them from outside: they are ratios.

    Attributes
    ----------
    cells_per_thickness : float, count
        Cells, on which the light is averaged, over the thickness of the gel.
        Source: virtual rigs (``experiments/relative_load.py``): with half as many, noise cannot be
        distinguished from a contact; twice as many are noisier.
    cells_per_width : float, count
        Fewest cells over the width of the image, so that a contact does not fill most of them.
        Source: chosen by hand; applies to views narrower than ten thicknesses.
    kept_thicknesses : float, gel thicknesses
        Standard deviation of the Gaussian whose result is subtracted from the change of the light.
        Source: half of a wave is kept where half of the slope of a half-space remains in a bonded
        layer of Poisson's ratio 0.48 (``experiments/relative_load.py`` prints both).
    lit_share : float, share of the bright level
        Darker cells of the reference are outside the gel surface.
        Source: that of the search for the illuminated area (:func:`lit_area`).
    bright_percentile : float, percent
        Percentile of the reference's cells that counts as bright.
        Source: that of the search for the illuminated area (:func:`lit_area`).
    least_visible : float, share of a cell
        A cell that markers hide further is left out.
        Source: chosen by hand; the mean of fewer pixels is noisier.
    least_share : float, share of the darkest lit intensity
        Lower bound of intensities, so that a shadow is no infinite change.
        Source: chosen by hand; a tenth keeps changes of brightness exact.
    fewest_cells : int, count
        With fewer illuminated cells there is no load.
        Source: chosen by hand; the rest level needs neighbours.
    """

    cells_per_thickness: float = 4.0
    cells_per_width: float = 40.0
    kept_thicknesses: float = 0.75
    lit_share: float = 0.2
    bright_percentile: float = 90.0
    least_visible: float = 0.25
    least_share: float = 0.1
    fewest_cells: int = 25


LIGHT_CHANGE = LightChangeParameters()  # The values in use

# Noise of unit variance keeps its variance, a plane vanishes. Every other cell, because compressed
# images have noise that neighbours share.
_LAPLACIAN = np.kron([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], [[1, 0], [0, 0]])[:5, :5] / 6


def change_in_detail(
    pixels: Array,
    reference: Array,
    hidden: Bool | None,
    thickness_px: float,
    parameters: LightChangeParameters = LIGHT_CHANGE,
) -> float:
    """Return the mean relative change of the light at lengths up to the gel's thickness.

    The change is the logarithm of the ratio to the reference in each channel, so that a common gain
    is a constant, which the high-pass removes. The amplitude over all channels is averaged over the
    illuminated surface, and that of noise, which the differences between neighbouring cells show
    [1]_, is subtracted: at rest the result is 0 on average.

    Parameters
    ----------
    pixels, reference : (H, W, K)
        Intensities on the same scale.
    hidden : (H, W) bool or None
        Pixels that a marker covers in either image.
    thickness_px : float
        Thickness of the gel.
    parameters : LightChangeParameters, optional
        Other values, for experiments.

    Returns
    -------
    float
        Dimensionless; 0 if too little of the surface is illuminated.

    References
    ----------
    .. [1] Immerkær, "Fast Noise Variance Estimation", Computer Vision and Image Understanding 64,
       1996: the mask.
    """
    height, width = reference.shape[:2]
    cell_px = min(thickness_px / parameters.cells_per_thickness, width / parameters.cells_per_width)
    size = _count(width, cell_px), _count(height, cell_px)
    now, before, visible = _cells(pixels, reference, hidden, size, parameters.least_visible)
    bright = before.max(axis=2)
    lit_from = parameters.lit_share * np.percentile(bright, parameters.bright_percentile)
    lit = visible & (bright > lit_from)
    if np.count_nonzero(lit) < parameters.fewest_cells:
        return 0.0
    least = parameters.least_share * lit_from
    change = np.log(np.maximum(now, least) / np.maximum(before, least))
    sigma = parameters.kept_thicknesses * thickness_px * size[0] / width
    kept = _amplitude(change - _smooth_values(change, lit, sigma))
    return float(np.mean(kept[lit])) - _rest_level(change, lit, ~visible)


def _count(pixels: int, cell_px: float) -> int:
    return min(pixels, max(1, round(pixels / cell_px)))


def _cells(
    pixels: Array,
    reference: Array,
    hidden: Bool | None,
    size: tuple[int, int],
    least_visible: float,
) -> tuple[Float32, Float32, Bool]:
    """Mean intensities of the visible part of each cell, and the cells that are visible."""
    images = np.asarray(pixels, np.float32), np.asarray(reference, np.float32)
    if hidden is None or not hidden.any():
        now, before = (shrink_image(image, size) for image in images)
        return now, before, np.ones(before.shape[:2], np.bool_)
    seen = (~hidden).astype(np.float32)
    share = shrink_image(seen, size)
    inverse = (1 / np.maximum(share, least_visible))[..., None]
    now, before = (
        np.asarray(shrink_image(image * seen[..., None], size) * inverse, np.float32)
        for image in images
    )
    return now, before, share >= least_visible


def _smooth_values(values: Float32, lit: Bool, sigma: float) -> Float32:
    """Gaussian mean of the illuminated cells."""
    weight = lit.astype(np.float32)
    total = cv2.GaussianBlur(weight, (0, 0), sigma)
    planes = [
        cv2.GaussianBlur(np.ascontiguousarray(values[..., k]) * weight, (0, 0), sigma)
        / np.maximum(total, np.finfo(np.float32).tiny)
        for k in range(values.shape[2])
    ]
    return np.stack(planes, axis=2)


def _amplitude(values: Float32) -> Float32:
    return np.asarray(np.sqrt(np.mean(values**2, axis=2)))


def _rest_level(change: Float32, lit: Bool, hidden: Bool) -> float:
    """Mean amplitude that noise alone would have, from the median of the second differences.

    Hidden cells take the mean of their neighbours, because few cells have none.
    """
    filled = np.where(lit[..., None], change, _smooth_values(change, lit, 1.0))
    surface = (lit | hidden).astype(np.uint8)
    inside = cv2.erode(surface, np.ones(_LAPLACIAN.shape, np.uint8), borderValue=0).view(np.bool_)
    if not (inside & lit).any():
        return 0.0
    count = change.shape[2]
    planes = [
        cv2.filter2D(np.ascontiguousarray(filled[..., k]), -1, _LAPLACIAN) for k in range(count)
    ]
    median = float(np.median(_amplitude(np.stack(planes, axis=2))[inside & lit]))
    return median * _mean_over_median(count)


def _mean_over_median(channels: int) -> float:
    """Mean over median of the length of a vector of standard normal numbers.

    The median is that of the Wilson–Hilferty approximation.
    """
    mean = sqrt(2) * exp(lgamma((channels + 1) / 2) - lgamma(channels / 2))
    return mean / sqrt(channels * (1 - 2 / (9 * channels)) ** 3)


Box = tuple[int, int, int, int]


_CLOSING_PX = 9  # [px] Side of the closing that bridges markers and dust
_BRIGHT_PERCENTILE: float = 90  # [percent] Percentile of the brightness that counts as bright


@dataclass(frozen=True)
class LitArea:
    """Upright rectangle of illuminated gel surface.

    Attributes
    ----------
    box : (x, y, width, height)
        In px.
    taper : float
        Width of the narrower end of the illuminated area over that of the wider one, along x or y:
        1 seen straight on, less seen at an angle.
    """

    box: Box
    taper: float


def lit_area(pixels: NDArray[Any]) -> LitArea | None:
    """Find the upright rectangle of illuminated gel surface in front of dark surroundings.

    The bounding box of the largest connected bright region shrinks until nine tenths of each side
    are illuminated. A gel seen at an angle is not an upright rectangle; its corners are cropped.

    Parameters
    ----------
    pixels : (H, W) or (H, W, 3) uint8 or uint16
        Image of the undeformed sensor.

    Returns
    -------
    LitArea or None
        None where nothing is to be cropped, or the bright area is too small for a gel surface.
    """
    from skimage.measure import label, regionprops  # late: the import takes longer than the rest

    height, width = pixels.shape[:2]
    shrink = max(1.0, max(height, width) / 256)  # [px] of the longer side
    size = max(1, round(width / shrink)), max(1, round(height / shrink))
    brightness = pixels if pixels.ndim == 2 else pixels.max(axis=2)
    small = cv2.resize(brightness.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    small = cv2.morphologyEx(
        cv2.GaussianBlur(small, (0, 0), 1.0),
        cv2.MORPH_CLOSE,
        np.ones((_CLOSING_PX,) * 2, np.uint8),
    )
    # [share of the bright level] darker pixels are not illuminated
    lit = small > 0.2 * np.percentile(small, _BRIGHT_PERCENTILE)
    labels = label(lit, connectivity=2)
    regions = regionprops(labels)
    if not regions:
        return None
    largest = max(regions, key=lambda region: region.area)
    surface = labels == largest.label
    left, top, right, bottom = _shrink_box(surface, largest.bbox)
    crop = max(left, top, size[0] - right, size[1] - bottom)
    share = (right - left) * (bottom - top) / (size[0] * size[1])
    # [shares of the longer side and of the image] So little is not worth cropping; so small a
    # rectangle is not the gel surface
    if crop < 0.02 * max(size) or share < 0.1:
        return None
    x0, x1 = (round(v * width / size[0]) for v in (left, right))
    y0, y1 = (round(v * height / size[1]) for v in (top, bottom))
    return LitArea((x0, y0, x1 - x0, y1 - y0), min(_taper(surface), _taper(surface.T)))


def _taper(surface: NDArray[np.bool_]) -> float:
    """Median width of the first and the last third of the rows, the narrower over the wider."""
    widths = surface.sum(axis=1)[surface.any(axis=1)]
    third = max(1, len(widths) // 3)
    ends = float(np.median(widths[:third])), float(np.median(widths[-third:]))
    return min(ends) / max(ends)


def _shrink_box(lit: NDArray[np.bool_], bounds: tuple[int, int, int, int]) -> Box:
    """Left, top, right and bottom after moving in the darkest side until all are illuminated."""
    top, left, bottom, right = bounds
    while right - left > 2 and bottom - top > 2:
        sides = {
            "left": lit[top:bottom, left].mean(),
            "right": lit[top:bottom, right - 1].mean(),
            "top": lit[top, left:right].mean(),
            "bottom": lit[bottom - 1, left:right].mean(),
        }
        darkest = min(sides, key=lambda side: sides[side])
        if sides[darkest] >= 0.9:  # [share of a side] the rest is dark
            break
        left += darkest == "left"
        right -= darkest == "right"
        top += darkest == "top"
        bottom -= darkest == "bottom"
    return left, top, right, bottom
