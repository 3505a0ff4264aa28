"""The number of markers, and the lattice on which they are printed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, get_args

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, spacings
from tactile_core.algorithms.markers.contrast import (
    Tone,
    brightness_of,
    check_image,
    compare_with_background,
    contrast_of,
)
from tactile_core.algorithms.markers.detection import find_markers, find_spots

# [ratio] Ratio of successive diameters: less than that of a spot to them, so that searches overlap
_LATTICE_DIAMETER_STEP = 1.25
_MIN_CONTRAST = 0.1  # [share of the background] Minimum of the typical contrast of the spots
_MIN_MARKERS = 12  # [count] Fewest spots that form a lattice: fewer are found in textures, too
_MIN_AREA_PX: float = 3


TONES: tuple[Tone, ...] = get_args(Tone)


class Lattice(NamedTuple):
    """Printed markers of an undeformed gel: tone, diameter and pitch."""

    tone: Tone
    diameter_px: float
    pitch_px: float


def find_marker_lattice(pixels: Array, tones: Sequence[Tone] = TONES) -> Lattice | None:
    """Find the tone, the diameter and the pitch of printed markers, if the gel has any.

    The tones and many diameters are tried. For each, spots count that are compact and close to
    that diameter, and most of them must have their nearest neighbour at the same distance. The
    diameter whose spots differ most from the gel, in their sum, wins.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        Image of the undeformed gel surface.
    tones : sequence of {"dark", "bright"}

    Returns
    -------
    Lattice or None
        None where fewer than twelve regular markers are found.

    Raises
    ------
    InputError
        The image is not (H, W, K).
    """
    check_image(pixels)
    smallest_px = 3.0  # [px] smaller markers are not measurable
    largest_px = min(pixels.shape[:2]) / 10.0  # at least ten diameters across
    count = max(0, int(np.log(largest_px / smallest_px) / np.log(_LATTICE_DIAMETER_STEP)) + 1)
    diameters_px = [smallest_px * _LATTICE_DIAMETER_STEP**i for i in range(count)]
    brightness = brightness_of(pixels, 1).astype(np.float32)
    tried = [_lattice(brightness, d, tone) for tone in tones for d in diameters_px]
    found = sorted(lattice for lattice in tried if lattice is not None)
    if len({lattice.tone for _, lattice in found}) == 2:
        tone = _tone_of_minority(brightness, found[-1][1].pitch_px)
        found = [scored for scored in found if scored[1].tone == tone]
    return found[-1][1] if found else None


def _tone_of_minority(brightness: Array, pitch_px: float) -> Tone:
    """Whether less of the surface is bright than dark: gaps between dots form a lattice, too."""
    around = (round(3 * pitch_px),) * 2  # [pitches] wide enough for marker and gap
    change = brightness / np.maximum(cv2.blur(brightness, around), 1e-6) - 1
    return "bright" if (change**3).mean() > 0 else "dark"


def _lattice(brightness: Array, diameter_px: float, tone: Tone) -> tuple[float, Lattice] | None:
    """Score and size of the markers of about this diameter, if they form a lattice."""
    # [px] against noise, and a share of the diameter against grain
    sigma_px = 0.3 + 0.08 * diameter_px
    smooth = np.asarray(cv2.GaussianBlur(brightness, (0, 0), sigma_px))
    contrast = compare_with_background(smooth, diameter_px, tone=tone)
    typical = _typical_peak(contrast, diameter_px)
    centres, sizes = _compact_spots(contrast > 0.5 * typical)  # half contrast
    # [ratio] of the size of a spot to the tried diameter
    fitting = np.abs(np.log(sizes / diameter_px)) < np.log(1.45)
    if typical < _MIN_CONTRAST or fitting.sum() < _MIN_MARKERS:
        return None
    centres, sizes = centres[fitting], sizes[fitting]
    nearest = spacings(centres)
    pitch = float(np.median(nearest))
    regular = np.abs(nearest / pitch - 1) < 0.2  # [pitches]
    if regular.sum() < max(_MIN_MARKERS, 0.7 * fitting.size):  # [share of the spots]
        return None
    size = float(np.median(sizes[regular]))
    # [diameters] A weave has spots that nearly touch; the 2015 paper has three
    if pitch < 1.5 * size:
        return None
    # the score is the sum of the contrast: corners of larger markers form a lattice, too
    return float(regular.sum()) * size**2 * typical, Lattice(tone, size, pitch)


def _typical_peak(contrast: Array, diameter_px: float) -> float:
    """Median of the peak contrast of the larger spots; 0 without any."""
    from scipy.ndimage import maximum

    spots = find_spots((contrast > _MIN_CONTRAST).view(np.uint8))
    # [squared diameters] smaller spots have no typical peak
    large = np.flatnonzero(spots.area > 0.2 * diameter_px**2) + 1
    if not large.size:
        return 0.0
    return float(np.median(maximum(contrast, spots.labels, large)))


def _compact_spots(marked: Bool) -> tuple[Array, Array]:
    """Centres (N, 2) and diameters (N,) of the compact spots that do not touch the border."""
    spots = find_spots(marked.view(np.uint8))
    low, high = spots.find_borders()
    keep = spots.compact & ~(low | high).any(axis=1) & (spots.area > _MIN_AREA_PX)
    return spots.centres[keep], np.sqrt(4 * spots.area[keep] / np.pi)


# [ratio] A smaller share of the expected markers is too small: 0.64 to 0.99 on images of seven real
# and three virtual gels, 0.13 to 0.22 where the diameter is too small to detect them; half also
# leaves room for a gel smaller than the view
_LEAST_SHARE = 0.5
# [ratio] Ratio of successive diameters that are tried: detection tolerates larger deviations
_DIAMETER_STEP = 1.15


def expected_count(shape: tuple[int, ...], pitch_px: float) -> int:
    """Return the number of markers of a square lattice that fills an image of shape (H, W, …)."""
    return round(shape[0] * shape[1] / pitch_px**2)


def too_few(count: int, shape: tuple[int, ...], pitch_px: float) -> bool:
    """Whether a number of markers contradicts their pitch."""
    return count < _LEAST_SHARE * expected_count(shape, pitch_px)


def find_detectable_lattice(
    pixels: Array, tones: Sequence[Tone] = TONES
) -> tuple[Lattice, int] | None:
    """Find a diameter of the printed markers with which they are detected, and their number.

    The diameter at half contrast can be too small for blurred markers. It is then increased until
    the number of detected markers fits their pitch.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        Image of the undeformed gel surface.
    tones : sequence of {"dark", "bright"}

    Returns
    -------
    (Lattice, count) or None
        The diameter at half contrast, if no larger one detects enough; None without markers.
    """
    found = find_marker_lattice(pixels, tones)
    if found is None:
        return None
    tone, diameter_px, pitch_px = found
    # [pitches] The gaps between wider markers are narrower than the markers
    steps = max(0, int(np.log(0.55 * pitch_px / diameter_px) / np.log(_DIAMETER_STEP)))
    first = 0
    for step in range(steps + 1):
        larger_px = diameter_px * _DIAMETER_STEP**step
        contrast = contrast_of(pixels, diameter_px=larger_px, tone=tone)
        shape = pixels.shape[0], pixels.shape[1]
        centres_px, _ = find_markers(contrast, shape, diameter_px=larger_px)
        if not too_few(len(centres_px), pixels.shape, pitch_px):
            return found._replace(diameter_px=larger_px), len(centres_px)
        first = first or len(centres_px)
    return found, first
