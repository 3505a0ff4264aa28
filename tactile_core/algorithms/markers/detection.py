"""Detects printed markers: threshold, connected components, moments."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64, UInt8
from tactile_core.algorithms.markers.contrast import CLOSING_DIAMETERS, FULL, square

_SMOOTHING_DIAMETERS = 1 / 3  # [marker diameters] Reach of the Gaussian kernel to either side
# [marker diameters] Side of the opening that removes lines and grain, which are thinner than
# markers
_OPENING_DIAMETERS = 0.4
# [marker diameters] Width of the rim that contains the blurred edge of a marker
_RIM_DIAMETERS = 0.28
# [share of the peak] Contrast above which a pixel belongs to the marker at the peak: chosen on a
# recording: 98.4 % of 123 markers stay found, 95.9 % at 0.5 (ADR 25)
_MARKER_SHARE = 0.6
# [share of the peak] Contrast that is subtracted before the moments are taken: chosen on a
# recording: with the rim, 0.27 px from the labels, 0.30 px without (ADR 25)
_BACKGROUND_SHARE = 0.15
# [share of the typical contrast] Contrast above which a pixel may belong to a marker at all
_MIN_CONTRAST = 0.3
# [typical markers] Minimum integrated contrast of a marker, and minimum difference of its contrast
# from that beside it: chosen on recorded prints, between dirt, up to 0.31, or the grain of pressed
# objects, and the smallest marker, 0.35, or the faintest, 0.39 (ADR 25)
_LEAST = 0.33


class Spots(NamedTuple):
    """Connected components of a mask.

    Attributes
    ----------
    labels : (H, W) uint16
        0 beside the spots, and i + 1 on spot i.
    low, high : (N, 2) int32
        First and last column and row of each spot.
    area : (N,) int32
        Number of pixels.
    centres : (N, 2) float64
        Mean position of the pixels, x and y.
    """

    labels: Array
    low: Array
    high: Array
    area: Array
    centres: Float64

    @property
    def compact(self) -> Bool:
        """(N,) spots that are neither thin nor ragged."""
        return self.is_compact(2.0)

    def is_compact(self, longest: float | Float64) -> Bool:
        """(N,) spots that are not ragged and at most ``longest`` times as long as wide."""
        width, height = (self.high - self.low + 1).T
        longer, shorter = np.maximum(width, height), np.minimum(width, height)
        filled = self.area > 0.55 * width * height  # [share of the box] a disc has π/4
        return np.asarray(filled & (longer <= longest * shorter))

    def find_borders(self) -> tuple[Bool, Bool]:
        """Whether each spot touches the left and the top border, and the right and the bottom."""
        last = np.array(self.labels.shape[::-1]) - 1
        return np.asarray(self.low == 0), np.asarray(self.high == last)


def find_spots(mask: UInt8) -> Spots:
    """Find the connected components of a mask; not 0 on spots."""
    _, labels, stats, centres = cv2.connectedComponentsWithStats(mask, ltype=cv2.CV_16U)
    low, size, area = stats[1:, :2], stats[1:, 2:4], stats[1:, cv2.CC_STAT_AREA]
    return Spots(labels, low, low + size - 1, area, np.asarray(centres[1:], np.float64))


def find_markers(
    contrast: UInt8, shape: tuple[int, ...], *, diameter_px: float
) -> tuple[Float32, Bool]:
    """Detect the printed markers of one frame, of any compact shape.

    The steps are those of [1]_: background, difference, threshold, connected components,
    centroids. Two of them differ:

    - The threshold is local: pixels belong to a marker whose contrast exceeds 0.6 of the peak
      contrast in their neighbourhood. So faint, strong, blurred and sharp markers are all
      thresholded at the same relative height. An opening removes texture of the object, which is
      thinner than markers.
    - Spots are selected relative to the typical marker of the frame: from a third of its integrated
      contrast on, and of the difference between its contrast and that on any of its sides. So the
      furrows of an object and the rim of the gel are no markers.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`tactile_core.algorithms.markers.contrast.contrast_of`.
    shape : (H, W)
        Shape of the image.
    diameter_px : float
        Diameter of a marker, in pixels of the image.

    Returns
    -------
    centres_px : (N, 2) float32
        x and y.
    truncated : (N,) bool
        Whether the image border truncates the marker. The centre of such a marker is extrapolated
        from the part in view and the diameter, and may be outside the image. Markers of which less
        than a third is in view are not detected.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    scale = shape[1] / contrast.shape[1], shape[0] / contrast.shape[0]
    size = diameter_px / scale[0]
    mask, weight = threshold_contrast(contrast, size)
    spots = find_spots(mask)
    rim = square(max(1, round(_RIM_DIAMETERS * size)))
    wide = np.asarray(cv2.dilate(spots.labels, rim))
    mass, centres = measure_spots(spots, wide, weight)
    low, high = spots.find_borders()
    borders = np.count_nonzero(low | high, axis=1)
    truncated = borders > 0
    # [ratio] the border may hide two thirds of a disc, whose rest is 2.8 times as long as wide
    compact = spots.is_compact(np.where(truncated, 2.8, 2.0))
    whole = compact & ~truncated
    if not whole.any():
        return np.zeros((0, 2), np.float32), np.zeros(0, np.bool_)
    excess = measure_excess(spots, wide, weight, compact, size_px=size)
    markers = compact & (borders < 2)  # corners of the image are dark at the edge of a view
    markers &= excess > _LEAST * np.median(excess[whole])
    markers &= mass > _LEAST * np.where(truncated, 1 / 3, 1) * np.median(mass[whole])
    centres = extrapolate_centres(centres, low, high, spots.labels.shape, size / 2)[markers]
    to_image = (centres + 0.5) * np.array(scale) - 0.5
    return to_image.astype(np.float32), truncated[markers]


def threshold_contrast(contrast: UInt8, size_px: float) -> tuple[UInt8, UInt8]:
    """Find the pixels of markers of this diameter, and weigh them and their surroundings.

    Returns
    -------
    mask : (h, w) uint8
        Not 0 on markers.
    weight : (h, w) uint8
        Contrast that counts for the centroid of the nearest marker.
    """
    smoothing = 2 * int(_SMOOTHING_DIAMETERS * size_px) + 1
    smooth = cv2.GaussianBlur(contrast, (smoothing, smoothing), 0)
    # the peak contrast around a pixel: as wide as the closing that estimates the background
    opening, reach = _OPENING_DIAMETERS / 2, CLOSING_DIAMETERS / 2
    thick = cv2.morphologyEx(smooth, cv2.MORPH_OPEN, square(int(opening * size_px)))
    peaks = np.asarray(cv2.dilate(thick, square(int(reach * size_px))), np.uint8)
    # [share of the background] a marker absorbs at least so much light, in any frame
    typical = max(find_typical_contrast(peaks), 0.08 * FULL)
    _, dark = cv2.threshold(thick, _MIN_CONTRAST * typical, FULL, cv2.THRESH_TOZERO)
    mask = cv2.compare(dark, cv2.convertScaleAbs(peaks, alpha=_MARKER_SHARE), cv2.CMP_GT)
    background = cv2.convertScaleAbs(peaks, alpha=_BACKGROUND_SHARE)
    return np.asarray(mask, np.uint8), np.asarray(cv2.subtract(smooth, background), np.uint8)


_SQUARES = np.arange(FULL + 1) ** 2


def find_typical_contrast(peaks: UInt8) -> float:
    """Find the peak contrast of a typical marker.

    Much of the image is near a marker and has its peak. Pixels are weighted by the square of their
    peak, so that grain between markers that are far apart does not count.
    """
    step = 6  # [px] for speed
    counts = np.bincount(peaks[::step, ::step].ravel(), minlength=FULL + 1)
    weight = np.cumsum(counts * _SQUARES)
    return float(weight.searchsorted(weight[-1] / 2))


def measure_spots(spots: Spots, wide: Array, weight: UInt8) -> tuple[Float64, Float64]:
    """Measure the mass (N,) and the centroid (N, 2) of spots, including their blurred edges.

    ``wide`` (H, W) has the labels of the spots with their rims. Where the rims of two spots
    overlap, a pixel belongs to the last spot.
    """
    (pixels,) = (wide.ravel() != 0).nonzero()  # three times as fast as of labels
    y, x = np.divmod(pixels, wide.shape[1])
    of, weights = wide.ravel()[pixels], weight.ravel()[pixels].astype(np.float64)
    count = len(spots.area) + 1
    mass = np.maximum(np.bincount(of, weights, count)[1:], 1e-9)
    sums = [np.bincount(of, weights * along, count)[1:] for along in (x, y)]
    return mass, np.stack(sums, axis=1) / mass[:, None]


def measure_excess(
    spots: Spots, wide: Array, weight: UInt8, compact: Bool, *, size_px: float
) -> Float64:
    """Measure by how much the weight of spots exceeds that on any of their sides, (N,).

    Print ends on all sides. A furrow of a pressed object, or the edge of the gel, goes on where the
    spot ends, or there is another one beside it.

    Parameters
    ----------
    spots : Spots
    wide : (H, W) uint16
        The labels of the spots with their rims.
    weight : (H, W) uint8
        From :func:`threshold_contrast`.
    compact : (N,) bool
        Spots that may be markers: they do not count as sides of others.
    size_px : float
        Diameter of a marker: the distance of its sides.
    """
    (inside,) = (spots.labels.ravel() != 0).nonzero()
    of = spots.labels.ravel()[inside]
    own = np.bincount(of, weight.ravel()[inside], len(spots.area) + 1)[1:] / spots.area
    turn = np.arange(8) * np.pi / 4
    sides = spots.centres[:, None] + size_px * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    last = np.array(weight.shape[::-1]) - 1
    x, y = np.moveaxis(np.clip(sides.round(), 0, last).astype(np.intp), -1, 0)
    others = np.append(True, ~compact).take(wide).view(np.uint8)
    window = (2 * round(size_px / 4) + 1,) * 2  # half a marker
    total = cv2.boxFilter(cv2.multiply(weight, others), cv2.CV_32F, window)[y, x]
    share = cv2.boxFilter(others, cv2.CV_32F, window)[y, x]
    return np.asarray(own - (total / np.maximum(share, 1e-6)).max(axis=1))


def extrapolate_centres(
    centres: Float64, low: Bool, high: Bool, shape: tuple[int, ...], radius: float
) -> Float64:
    """Move the centres of truncated markers outwards; they may end outside the image.

    The part in view is twice as deep as the distance of its centroid from the border.
    """
    last = np.array(shape[::-1]) - 1.0
    from_low = np.minimum(2 * centres + 0.5 - radius, centres)
    from_high = np.maximum(2 * centres - last - 0.5 + radius, centres)
    return np.asarray(np.where(low, from_low, np.where(high, from_high, centres)))
