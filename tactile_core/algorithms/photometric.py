"""What the light says: the relative change of each channel since the untouched sensor."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]


def masked_blur(image: Float32, weight: Float32, sigma_px: float) -> Float32:
    """Gaussian blur that ignores pixels of weight 0, and fills them from their neighbours.

    Parameters
    ----------
    image : (H, W) or (H, W, K) float32
    weight : (H, W) float32
        1 where a pixel counts, 0 where it does not.
    sigma_px : float

    Returns
    -------
    array of the image's shape, float32
    """
    total = np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma_px), 1e-6)
    if image.ndim == 3:
        weight, total = weight[..., None], total[..., None]
    blurred = cv2.GaussianBlur(image * weight, (0, 0), sigma_px)
    return np.asarray(blurred.reshape(image.shape) / total, np.float32)


def relative_change(
    pixels: NDArray[Any],
    reference: Float32,
    *,
    marks: NDArray[np.bool_] | None = None,
    reference_marks: NDArray[np.bool_] | None = None,
    sigma_px: float = 1.5,
    floor: float = 15.0,
) -> Float32:
    """(I − I₀) / I₀ of each channel, slightly blurred, with markers filled from around them.

    A ratio is independent of how brightly each lamp lights each place, which the plain difference
    is not; measured on real balls it halves the error that position leaves.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    reference : (H, W, K) float32
        The untouched sensor, on the same scale.
    marks, reference_marks : (H, W) bool, optional
        Pixels that show a marker, now and untouched.
    sigma_px : float
        Blur of the change; the coating's grain is about a pixel.
    floor : float
        Intensities below it are too dark to divide by.

    Returns
    -------
    (H, W, K) float32
        0 where nothing changed.
    """
    frame = pixels.astype(np.float32)
    base = cv2.GaussianBlur(reference, (0, 0), 1.0).reshape(reference.shape)
    if reference_marks is not None:
        base = masked_blur(reference, (~reference_marks).astype(np.float32), 3.0)
    change = (frame - reference) / np.maximum(base, floor)
    if marks is None and reference_marks is None:
        return np.asarray(cv2.GaussianBlur(change, (0, 0), sigma_px).reshape(change.shape))
    weight = np.ones(change.shape[:2], np.float32)
    for mask in (marks, reference_marks):
        if mask is not None:
            weight[mask] = 0
    return masked_blur(change, weight, sigma_px)
