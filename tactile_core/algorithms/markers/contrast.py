"""The contrast of markers with the gel, and what a marker looks like."""

from __future__ import annotations

from functools import cache
from typing import Any

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import repeat_pixels, shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, UInt8
from tactile_core.errors import InputError

FULL = 255  # Contrast of a pixel that reflects no light at all


class CONTRAST:
    """Parameters of the marker contrast. They are relative to a marker's size and to the light."""

    # [marker diameters] Side of the square of the closing that estimates the background. Darker
    # structures that are wider than this are background. Source: chosen on recorded markers (ADR
    # 25).
    closing_diameters = 2.2
    # [share of full scale] Lower bound of the background, so that noise in a dark image does not
    # become contrast.
    darkest_background = 0.08
    # [px] The image is reduced by a whole factor as long as a marker keeps this diameter. Source:
    # by hand, for speed.
    coarse_diameter_px = 6.0
    # [share of the background] Pixels that lose at least this share of the light are masked as
    # marker.
    masked_contrast = 0.12


def contrast_of(pixels: Array, *, diameter_px: float, halves: UInt8 | None = None) -> UInt8:
    """Return how much darker each pixel is than its background.

    The background is a morphological closing of the same frame, wide enough to remove a marker.
    The contrast is the bottom-hat transform divided by that background, so it is insensitive to
    the strength and color of the illumination and to shading that is wider than a marker. The
    papers subtract a blurred first frame instead [1]_, which no longer fits once a contact changes
    the shading. Images with large markers are reduced first.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Diameter of a marker.
    halves : (H / 2, W / 2, 3) uint8, optional
        The means over 2 × 2 pixels, if they are known.

    Returns
    -------
    (H // n, W // n) uint8
        0 for the background, 255 for a pixel without any light. The factor n is 1 to 4; a reduced
        marker still measures 6 pixels.

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    check_image(pixels)
    if not diameter_px > 0:
        raise InputError(f"markers of {diameter_px} px cannot be found; give a positive diameter")
    times = reduction(diameter_px)
    reach = _closing_reach(diameter_px / times)
    if halves is not None and times % 2 == 0:
        pixels, times = halves, times // 2
    brightness = brightness_of(pixels, times)
    background = _close_brightness(brightness, reach)
    lost = cv2.subtract(background, brightness)
    if lost.dtype == np.uint8:
        return np.asarray(cv2.divide(lost, background, scale=FULL), np.uint8)
    relative = cv2.divide(lost, background, scale=FULL, dtype=cv2.CV_32F)
    return np.asarray(cv2.convertScaleAbs(relative))


def reduction(diameter_px: float) -> int:
    """Factor by which an image is reduced before the contrast of such markers is measured."""
    return max(1, min(4, int(diameter_px / CONTRAST.coarse_diameter_px)))


def check_image(pixels: Array) -> None:
    """Check the shape of an image.

    Raises
    ------
    InputError
        The shape is not (H, W) or (H, W, K), or the image is empty.
    """
    if pixels.ndim not in (2, 3) or 0 in pixels.shape:
        raise InputError(f"an image is (H, W) or (H, W, K); this one is {pixels.shape}")


def brightness_of(pixels: Array, times: int) -> Array:
    """(h, w) mean of the channels of an image that is reduced by a whole factor."""
    pixels = _shrink_pixels(pixels, times)
    if pixels.ndim == 2:
        return pixels
    share = np.full((1, pixels.shape[2]), 1 / pixels.shape[2], np.float32)
    return cv2.transform(pixels, share).reshape(pixels.shape[:2])


def background_of(brightness: Array, diameter_px: float) -> Array:
    """Brightness (h, w) with the markers closed, bounded from below where the image is dark."""
    return _close_brightness(brightness, _closing_reach(diameter_px))


def _closing_reach(diameter_px: float) -> int:
    return round(0.5 * CONTRAST.closing_diameters * diameter_px)


def _close_brightness(brightness: Array, reach: int) -> Array:
    closed = cv2.morphologyEx(brightness, cv2.MORPH_CLOSE, square(reach))
    full = FULL if closed.dtype == np.uint8 else max(float(closed.max()), 1e-6)
    darkest: Any = CONTRAST.darkest_background * full  # OpenCV's type hints omit scalars
    return np.asarray(cv2.max(closed, darkest))


def _shrink_pixels(pixels: Array, times: int) -> Array:
    if times == 1:
        return pixels
    height, width = pixels.shape[:2]
    return shrink_image(pixels, (max(1, width // times), max(1, height // times)))


@cache
def square(reach: int) -> UInt8:
    """Return the structuring element of all pixels within ``reach`` rows and columns."""
    return np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)


def marker_mask(
    pixels: Array, *, diameter_px: float, contrast: float = CONTRAST.masked_contrast
) -> Bool:
    """Mask the dark markers of an image, with a rim of one pixel.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Diameter of a marker.
    contrast : float
        Minimum share of the light that a marker absorbs.

    Returns
    -------
    (H, W) bool

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.
    """
    return mask_of(
        contrast_of(pixels, diameter_px=diameter_px), pixels.shape[:2], min_contrast=contrast
    )


def mask_of(
    contrast: UInt8,
    shape: tuple[int, ...],
    *,
    min_contrast: float = CONTRAST.masked_contrast,
) -> Bool:
    """Threshold the marker contrast, and add a rim of one pixel.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`contrast_of`.
    shape : (H, W)
        Shape of the image.
    min_contrast : float
        Minimum share of the light that a marker absorbs.

    Returns
    -------
    (H, W) bool
    """
    _, above = cv2.threshold(contrast, min_contrast * FULL, 1, cv2.THRESH_BINARY)
    dark = np.asarray(above, np.uint8)
    return np.asarray(cv2.dilate(repeat_pixels(dark, shape), square(1))).view(np.bool_)


class DETECTION:
    """Parameters of marker detection. Nothing sets them from outside: they are relative.

    Lengths are relative to the marker's diameter, contrast and mass to the typical marker of the
    same frame. So they hold for any print, resolution and light.
    """

    smoothing_diameters = 1 / 3  # [marker diameters] Reach of the Gaussian kernel to either side
    # [marker diameters] Side of the opening that removes lines and grain, which are thinner than
    # markers.
    opening_diameters = 0.4
    # [marker diameters] Side of the square in which the peak contrast around a pixel is taken.
    # Source: as wide as the closing that estimates the background.
    peak_diameters = 2.2
    # [marker diameters] Width of the rim that contains the blurred edge of a marker.
    rim_diameters = 0.28
    # [px] Every how many pixels the typical contrast is sampled. Source: by hand, for speed.
    sample_step_px = 6
    # [share of the peak] Contrast above which a pixel belongs to the marker at the peak. Source:
    # chosen on a recording: 98.4 % of 123 markers stay found, 95.9 % at 0.5 (ADR 25).
    marker_share = 0.6
    # [share of the peak] Contrast that is subtracted before the moments are taken. Source: chosen
    # on a recording: with the rim, 0.27 px from the labels, 0.30 px without (ADR 25).
    background_share = 0.15
    # [share of the background] Share of the light that a marker absorbs at least, in any frame.
    min_marker_contrast = 0.08
    # [share of the typical contrast] Contrast above which a pixel may belong to a marker at all.
    min_contrast = 0.3
    # [share of the typical contrast] Peak of the faintest marker. Source: chosen on recorded
    # prints, whose faint markers have 0.35 (ADR 25).
    faintest_peak = 0.28
    # [share of the 5th percentile] Peak of the faintest marker relative to nearly the faintest of
    # the frame. An even print has no faint markers, so that faint spots in it are shading.
    faintest_peak_of_print = 0.45
    # [share of the markers] Percentile that represents the faintest marker of the frame. Source:
    # by hand, robust against a few outliers.
    faint_percentile = 0.05
    # [share] Spots below this share of the mass-weighted median are specks and do not count when
    # the typical marker is estimated.
    speck_mass = 0.2
    # [typical markers] Range of a marker's mass. Source: the lower end was chosen on recorded
    # prints, between the dirt, up to 0.31, and the smallest marker, 0.35 (ADR 25); the upper end
    # by hand, no script derives it.
    min_mass = 0.33
    max_mass = 9.0
    # [typical markers] Minimum mass in view of a marker that the border truncates.
    min_truncated_mass = 0.12
    # [typical markers] Minimum of mass times peak; a spot that is both faint and small is dirt.
    min_mass_times_peak = 0.11
    # [ratio] Maximum ratio of the standard deviations along the major and the minor axis.
    max_elongation = 2.4
    # [ratio] Minimum mass relative to that of a uniform ellipse with the same moments and peak.
    min_fill = 0.57
    # [standard deviations] Half the size of a marker. Source: between a disc, 2, and a square,
    # √3.
    half_size_sigmas = 1.85
    # [half sizes] Maximum standard deviation along the major axis of what the border leaves of a
    # marker.
    max_truncated_sigma = 0.7
    # [float), typical markers] Range of the mass of one piece of a marker that a highlight
    # splits.
    piece_mass = (0.12, 0.75)
    # [float), typical markers] Range of the mass of both pieces together. Source: by hand, around
    # 1.
    pieces_mass = (0.5, 1.35)
    # [half sizes] Maximum distance between the centroids of the two pieces. Source: by hand, the
    # pieces of one marker are at most one diameter apart.
    piece_distance = 1.5
    # [typical markers] Minimum mass of a bar, that is of markers that have merged. Source: by
    # hand, below the 2 of two markers.
    bar_mass = 1.6
    bar_sigma = 0.8  # [half sizes] Maximum standard deviation of a bar along its minor axis
    bar_peak = 0.75  # [typical markers] Minimum peak of a bar
    # [pitches] Deviation from the pitch that the markers of a bar may have.
    bar_pitch_tolerance = 0.4
