"""Circles in the image, and their symmetry."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import vertex
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.press import PressChange


@dataclass(frozen=True)
class Circle:
    """Contact circle of a ball.

    Attributes
    ----------
    centre_px : (x, y)
        0-based, integers at pixel centres.
    contact_radius_px : float
    why : str
        Reason for excluding it; "" if it is good enough to calibrate on.
    centre_std_px : float
        Standard deviation of each coordinate of the centre; NaN for a circle that was given.
    radius_std_px : float
        Standard deviation of the radius; NaN for a circle that was given.
    """

    centre_px: tuple[float, float]
    contact_radius_px: float
    why: str = ""
    centre_std_px: float = float("nan")
    radius_std_px: float = float("nan")

    @property
    def used(self) -> bool:
        """Whether it is good enough to calibrate on."""
        return not self.why


# [ball radii] Radius of the window around that place, and width over which it falls to 0.
_WINDOW_RADII = 1.6
_TAPER_RADII = 0.4


def odd_centre(change: PressChange, ball_radius: float) -> tuple[Float64, float]:
    """Estimate the centre of a press from that press alone.

    Opposite slopes change the colour oppositely, so d(c + v)·d(c − v) is negative on a ball with
    centre c, and the self-convolution of the change d is most negative at 2c.

    Parameters
    ----------
    change : PressChange
    ball_radius : float
        In working pixels.

    Returns
    -------
    centre : (2,) float64
        In working pixels, to half a pixel or better.
    oddness : float
        −1 (even) to 1 (perfectly odd).
    """
    values = change.weighted
    # [ball radii] Standard deviation of the smoothing before the place of the strongest change is
    # taken.
    energy = cv2.GaussianBlur(change.energy, (0, 0), 0.7 * ball_radius)
    peak_y, peak_x = np.unravel_index(int(np.argmax(energy)), energy.shape)
    # Nothing outside the window counts: transforming a section is faster.
    reach = int(np.ceil(_WINDOW_RADII * ball_radius))
    top, left = max(0, int(peak_y) - reach), max(0, int(peak_x) - reach)
    section = np.s_[top : int(peak_y) + reach + 1, left : int(peak_x) + reach + 1]
    values, weight = values[section], change.weight[section]
    h, w = weight.shape
    px, py = int(peak_x) - left, int(peak_y) - top
    inside = _WINDOW_RADII - np.hypot(np.arange(w) - px, np.arange(h)[:, None] - py) / (ball_radius)
    window = np.clip(inside, 0, _TAPER_RADII) / _TAPER_RADII
    size = (2 * h, 2 * w)
    spectrum = np.fft.rfft2(values * window[..., None], size, axes=(0, 1))
    odd = np.fft.irfft2((spectrum**2).sum(2), size)
    square = np.fft.rfft2(change.energy[section] * window, size)
    even = np.fft.irfft2(square * np.fft.rfft2(weight * window, size), size)
    # [share of the greatest energy] Lower bound of the divisor of the score, so that a small
    # overlap has no high score.
    score = -odd / np.maximum(even, 0.25 * even.max() + 1e-12)
    far = np.hypot(np.arange(2 * w) / 2 - px, np.arange(2 * h)[:, None] / 2 - py)
    # [ball radii] Largest distance of the centre from that place
    score[far > 0.8 * ball_radius] = -np.inf
    j, i = np.unravel_index(int(np.argmax(score)), score.shape)
    peak = np.array([i, j], float)
    if 0 < i < 2 * w - 1 and 0 < j < 2 * h - 1:
        lines = score[j, i - 1 : i + 2], score[j - 1 : j + 2, i]
        peak += [vertex(line) if np.isfinite(line).all() else 0.0 for line in lines]
    return peak / 2 + (left, top), float(score[j, i])


def oddness_at(change: PressChange, centre: Float64, radius: float) -> float:
    """Oddness of the change about a given centre, within a radius.

    −1 is even and 1 is odd; 0 where nothing is visible.
    """
    x, y = change.disc(centre, radius)
    h, w = change.shape
    opposite = np.rint(2 * centre - np.stack([x, y], 1)).astype(int)
    inside = ((opposite >= 0) & (opposite < (w, h))).all(1)
    values = change.weighted
    here, there = values[y[inside], x[inside]], values[tuple(opposite[inside].T[::-1])]
    square = float((here**2).sum() + (there**2).sum())
    return -2 * float((here * there).sum()) / square if square > 0 else 0.0
