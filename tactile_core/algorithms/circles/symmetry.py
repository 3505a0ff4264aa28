"""Where to start: the point about which the colour change is most odd."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.press import Change


def odd_centre(change: Change, ball_radius: float) -> tuple[Float64, float]:
    """Find the centre of a press from the press alone.

    Opposite slopes change the colour oppositely, so d(c + v)·d(c − v) is negative on a ball about
    its centre c, and the self-convolution of d has its most negative value at 2c.

    Returns
    -------
    centre : (2,) float64
        In working pixels, to half a pixel or better.
    oddness : float
        −1 even … 1 perfectly odd.
    """
    h, w = change.weight.shape
    values = change.values * change.weight[..., None]
    energy = cv2.GaussianBlur((values**2).sum(2), (0, 0), 0.7 * ball_radius)
    py, px = np.unravel_index(int(np.argmax(energy)), energy.shape)
    x, y = np.arange(w), np.arange(h)[:, None]
    window = np.clip(1.6 - np.hypot(x - px, y - py) / ball_radius, 0, 0.4) / 0.4
    weight = change.weight * window
    size = (2 * h, 2 * w)
    spectrum = np.fft.rfft2(change.values * weight[..., None], size, axes=(0, 1))
    odd = np.fft.irfft2((spectrum**2).sum(2), size)
    square = np.fft.rfft2((change.values**2).sum(2) * weight, size)
    even = np.fft.irfft2(square * np.fft.rfft2(weight, size), size)
    score = -odd / np.maximum(even, 0.25 * even.max() + 1e-12)
    far = np.hypot(np.arange(2 * w) / 2 - px, np.arange(2 * h)[:, None] / 2 - py)
    score[far > 0.8 * ball_radius] = -2
    j, i = np.unravel_index(int(np.argmax(score)), score.shape)
    peak = np.array([i, j], float)
    if 0 < i < 2 * w - 1 and 0 < j < 2 * h - 1:
        lines = score[j, i - 1 : i + 2], score[j - 1 : j + 2, i]
        peak += [vertex(line) if line.min() > -2 else 0.0 for line in lines]
    return peak / 2, float(score[j, i])


def vertex(three: Float64) -> float:
    """Offset of a parabola's top from the middle of three samples."""
    left, middle, right = three
    curve = left - 2 * middle + right
    return float(0.5 * (left - right) / curve) if curve < 0 else 0.0
