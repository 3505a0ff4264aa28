"""Number of markers in an image, compared with the number that their pitch lets expect."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.markers.contrast import contrast_of
from tactile_core.algorithms.markers.detection import find_markers
from tactile_core.algorithms.markers.lattice import find_marker_diameter


class COUNT:
    """Parameters of the comparison. Nothing sets them from outside."""

    # [ratio] A smaller share of the expected markers is too small. Source: 0.64 to 0.99 on images
    # of seven real and three virtual gels, 0.13 to 0.22 where the diameter is too small to detect
    # them; half also leaves room for a gel smaller than the view.
    least_share = 0.5
    # [ratio] Ratio of successive diameters that are tried. Source: by hand, detection tolerates
    # larger deviations.
    diameter_step = 1.15
    # [pitches] Largest diameter that is tried. Source: geometry: the gaps between wider markers
    # are narrower than the markers.
    widest = 0.55


def expected_count(shape: tuple[int, ...], pitch_px: float) -> int:
    """Return the number of markers of a square lattice that fills an image of shape (H, W, …)."""
    return round(shape[0] * shape[1] / pitch_px**2)


def too_few(count: int, shape: tuple[int, ...], pitch_px: float) -> bool:
    """Whether a number of markers contradicts their pitch."""
    return count < COUNT.least_share * expected_count(shape, pitch_px)


def detectable_diameter(pixels: Array) -> tuple[float, float, int] | None:
    """Find a diameter of the printed markers with which they are detected.

    The diameter at half contrast can be too small for blurred markers. It is then increased until
    the number of detected markers fits their pitch.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        Image of the undeformed gel surface.

    Returns
    -------
    (diameter_px, pitch_px, count) or None
        The diameter at half contrast, if no larger one detects enough; None without markers.
    """
    found = find_marker_diameter(pixels)
    if found is None:
        return None
    diameter_px, pitch_px = found
    steps = max(0, int(np.log(COUNT.widest * pitch_px / diameter_px) / np.log(COUNT.diameter_step)))
    first = 0
    for step in range(steps + 1):
        larger_px = diameter_px * COUNT.diameter_step**step
        centres_px, _ = find_markers(
            contrast_of(pixels, diameter_px=larger_px),
            (pixels.shape[0], pixels.shape[1]),
            diameter_px=larger_px,
            pitch_px=pitch_px,
        )
        if not too_few(len(centres_px), pixels.shape, pitch_px):
            return larger_px, pitch_px, len(centres_px)
        first = first or len(centres_px)
    return diameter_px, pitch_px, first
