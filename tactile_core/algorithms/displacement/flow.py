"""Dense optical flow of the object's imprint, for gels without markers."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import sigma_of
from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array, Float32

_FAINT_RMS = 0.006  # [share of full scale] RMS of an imprint at which its weight is one half


# Immerkær's mask, scaled so that white noise keeps its variance.
_NOISE_KERNEL = np.outer([1, -2, 1], [1, -2, 1]).astype(np.float32) / 6


@dataclass(frozen=True, eq=False)
class TextureImprint:
    """The change of the image that an object causes, with normalised contrast.

    Attributes
    ----------
    grey : (h, w) uint8
        Reduced to at most 320 px; 128 where the image is unchanged.
    weight : (h, w) float32
        0 to 1: how much texture there is to track.
    """

    grey: NDArray[np.uint8]
    weight: Float32


def detail(pixels: Array, full_scale: float) -> Float32:
    """High-pass filter the brightness, which removes illumination drift.

    Parameters
    ----------
    pixels : (H, W, K)
    full_scale : float
        Largest intensity.

    Returns
    -------
    (h, w) float32
        Reduced to at most 320 px; 1 is the full scale.
    """
    factor = max(1.0, max(pixels.shape[:2]) / 320)  # [px] for speed (ADR 27)
    height, width = (max(1, round(side / factor)) for side in pixels.shape[:2])
    small = shrink_image(pixels, (width, height)).reshape(height, width, -1)
    share = np.full((1, small.shape[2]), 1 / (small.shape[2] * full_scale), np.float32)
    bright = (small.astype(np.float32) @ share[0]).astype(np.float32)
    # [px] Standard deviation of the high-pass filter
    return np.asarray(bright - cv2.GaussianBlur(bright, (0, 0), 6.0), np.float32)


def imprint(now: Float32, undeformed: Float32) -> TextureImprint:
    """Return the imprint, given the :func:`detail` of a frame and of the undeformed surface."""
    change = now - undeformed
    window = (29, 29)  # [px] Two boxes average the energy of the imprint
    energy = cv2.blur(cv2.blur(change * change, window), window)
    energy = np.maximum(energy - np.float32(_noise_energy(change)), 0)
    energy *= np.float32(_FAINT_RMS**-2)
    # [grey levels] Three standard deviations of a strong imprint are within 8 bits
    normalised = change * (np.float32(40.0 / _FAINT_RMS) / np.sqrt(energy + 1))
    # [grey levels] the middle of 8 bits
    grey = np.clip(normalised + np.float32(128.0), 0, 255).astype(np.uint8)
    return TextureImprint(grey, np.asarray(1 - 1 / (1 + energy * energy), np.float32))


def motion(earlier: TextureImprint, now: TextureImprint, start_px: Float32) -> Float32:
    """Return the optical flow between two imprints, by dense inverse search (DIS) [1]_.

    Parameters
    ----------
    earlier, now : TextureImprint
        Of the same size.
    start_px : (h, w, 2) float32
        Initial flow.

    Returns
    -------
    (h, w, 2) float32
        Displacement since ``earlier`` of what is now at each pixel, px. It is meaningless where
        there is no texture; see :func:`fill_untextured`.

    References
    ----------
    .. [1] T. Kroeger, R. Timofte, D. Dai and L. Van Gool, "Fast optical flow using dense inverse
       search", ECCV, 2016.
    """
    # a new object for each call: it keeps buffers, which threads must not share
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    return np.asarray(-search.calc(now.grey, earlier.grey, -start_px), np.float32)


def fill_untextured(moved_px: Float32, weight: Float32, *, reach_px: float) -> Float32:
    """Replace motion without texture by that of its surroundings, and by 0 far from any texture.

    Parameters
    ----------
    moved_px : (h, w, 2) float32
    weight : (h, w) float32
        Confidence in the motion, 0 to 1.
    reach_px : float
        Standard deviation of the Gaussian that extrapolates the motion.

    Returns
    -------
    (h, w, 2) float32

    References
    ----------
    .. [1] H. Knutsson and C.-F. Westin, "Normalized and differential convolution", CVPR, 1993.
    """
    height, width = weight.shape
    weighted = np.dstack([moved_px * weight[..., None], weight])
    coarser = 4  # [ratio] for speed
    small = shrink_image(weighted, (max(1, width // coarser), max(1, height // coarser)))
    wide = cv2.GaussianBlur(small, (0, 0), reach_px / coarser)
    # [weight] Motion fades out far from any texture
    around = wide[..., :2] / (wide[..., 2:] + np.float32(0.1))
    around = cv2.resize(around, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(around + weight[..., None] * (moved_px - around), np.float32)


def compose_motions(before_px: Float32, moved_px: Float32) -> Float32:
    """Return the total motion of ``before_px`` followed by ``moved_px``.

    Parameters
    ----------
    before_px, moved_px : (h, w, 2) float32
        Each refers to the position at its end.

    Returns
    -------
    (h, w, 2) float32
        Refers to the present position.
    """
    height, width = moved_px.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    was_x, was_y = x - moved_px[..., 0], y - moved_px[..., 1]
    before = cv2.remap(before_px, was_x, was_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved_px + before, np.float32)


def _noise_energy(change: Float32) -> float:
    """Variance of the noise, estimated robustly.

    References
    ----------
    .. [1] J. Immerkær, "Fast noise variance estimation", Computer Vision and Image Understanding
       64(2), 1996.
    """
    step = 3  # [px] for speed
    residual = cv2.filter2D(change, cv2.CV_32F, _NOISE_KERNEL)[1:-1:step, 1:-1:step]
    return float(1.2 * sigma_of(residual.ravel()) ** 2)  # [ratio] More is subtracted than estimated
