"""Pitch of a square pattern in an image: printed lines, checks or dots, or a gel's markers."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float64

_SQUARE = 0.15  # Largest deviation from a square, pitches: that of a hexagonal pattern is 0.5

# Largest error, share: what repeats less evenly is a strongly tilted view or no pattern.
_UNSURE = 0.05


@dataclass(frozen=True)
class GridPitch:
    """Pitch of a square pattern at the centre of the image.

    Attributes
    ----------
    x_px, y_px : float
        Pixels per pitch along x and along y, whatever the rotation of the pattern; of checks, per
        side of a square.
    error : float, share
        Standard error of both. It covers noise, and half the square of ``variation``.
    variation : float, share
        Change of the pitch from the centre to a corner, by perspective.
    """

    x_px: float
    y_px: float
    error: float
    variation: float


def measure_pitch(pixels: Array) -> GridPitch | None:
    """Measure a square pattern by its two fundamental waves.

    The waves are the peaks of the spectrum. Around each, the local frequency is the derivative of
    the phase; a plane fitted to it gives the frequency at the centre in spite of perspective. Both
    frequencies are those of a lattice whose vectors, scaled along x and along y, are orthogonal and
    of length one.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)

    Returns
    -------
    GridPitch or None
        None without a square pattern that repeats at least four times.
    """
    grey = np.atleast_3d(np.asarray(pixels, np.float32)).mean(axis=2)
    background = cv2.GaussianBlur(grey, (0, 0), min(grey.shape) / 8)
    contrast = grey / np.maximum(background, 1e-3 * max(float(background.max()), 1e-9)) - 1
    peaks = _fundamentals(contrast)
    if peaks is None:
        return None
    # twice: the first demodulates with the frequency of the peak, the second with the centre's
    waves = [_Wave.near(contrast, _Wave.near(contrast, peak).frequency) for peak in peaks]
    if max(wave.error for wave in waves) > _UNSURE:
        return None
    one, two = (wave.frequency for wave in waves)
    overtones = [_Wave.near(contrast, twice) for twice in (2 * one, 2 * two, one + two, one - two)]
    strength = max(wave.amplitude for wave in overtones) / min(wave.amplitude for wave in waves)
    # [ratio of the second harmonics] Checks have 0.11, lines and dots 0.4 and more
    side = np.sqrt(0.5) if strength < 0.25 else 1.0
    a, b = np.linalg.inv([one, two]).T * side
    lengths = np.array([a * a, b * b, a * b])
    per_px, *_ = np.linalg.lstsq(lengths, np.array([1.0, 1.0, 0.0]), rcond=None)
    if per_px.min() <= 0 or np.abs(lengths @ per_px - [1, 1, 0]).max() > _SQUARE:
        return None
    x_px, y_px = 1 / np.sqrt(per_px)
    variation = max(wave.variation for wave in waves)
    error = float(np.hypot(2 * max(wave.error for wave in waves), variation**2 / 2))
    return GridPitch(float(x_px), float(y_px), error, variation) if error < _UNSURE else None


def _fundamentals(contrast: Array) -> tuple[Float64, Float64] | None:
    """Frequencies (x, y) of two waves about at right angles, in cycles per px."""
    height, width = contrast.shape
    window = np.outer(np.hanning(height), np.hanning(width))
    size = 2 * max(height, width)
    power = np.abs(np.fft.rfft2((contrast - contrast.mean()) * window, s=(size, size)))
    fy, fx = np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None, :]
    length = np.hypot(fx, fy)
    # With fewer periods, uneven light looks like a pattern; of a pitch below 4 px a camera resolves
    # no second harmonic
    seen = (length > 3.5 / min(height, width)) & (length < 1 / 4.0)
    power = np.where(seen, power, 0)
    if not power.any():
        return None
    first = np.unravel_index(int(power.argmax()), power.shape)
    one = np.array([fx[0, first[1]], fy[first[0], 0]])
    along = np.abs(fx * one[0] + fy * one[1])
    ratio = length / np.hypot(*one)
    across = (along < 0.5 * length * np.hypot(*one)) & (ratio > 0.7) & (ratio < 1.4)
    second = np.unravel_index(int(np.where(across, power, 0).argmax()), power.shape)
    two = np.array([fx[0, second[1]], fy[second[0], 0]])
    # [ratio to the median spectrum] Most gels without markers reach 17, with them 160; the weaker
    # peak of a square pattern is at least 0.3 of the other
    least = max(40.0 * float(np.median(power[seen])), 0.3 * float(power[first]))
    return (one, two) if power[second] > least else None


@dataclass(frozen=True)
class _Wave:
    """A wave whose frequency, cycles per px, may vary linearly over the image."""

    frequency: Float64
    amplitude: float
    error: float
    variation: float

    @classmethod
    def near(cls, contrast: Array, frequency: Float64) -> _Wave:
        height, width = contrast.shape
        x, y = np.arange(width) - (width - 1) / 2, (np.arange(height) - (height - 1) / 2)[:, None]
        turned = contrast * np.exp(-2j * np.pi * (frequency[0] * x + frequency[1] * y))
        sigma_px = 0.7 / float(np.hypot(*frequency))  # [pitches] leaves 1e-4 of a harmonic
        real, imaginary = (
            cv2.GaussianBlur(part.astype(np.float32), (0, 0), sigma_px)
            for part in (turned.real, turned.imag)
        )
        wave = real + 1j * imaginary
        # each fourth of a pitch, without the border, where the smoothing reaches outside
        margin, step = int(1.5 * sigma_px) + 2, max(1, int(sigma_px / 2))
        if 2 * margin >= min(height, width):
            return cls(frequency, 0.0, np.inf, np.inf)
        rows = np.arange(margin, height - margin, step)[:, None]
        columns = np.arange(margin, width - margin, step)[None, :]
        weight = np.abs(wave[rows, columns]).ravel()
        across = wave[rows, columns + 1] * wave[rows, columns - 1].conj()
        down = wave[rows + 1, columns] * wave[rows - 1, columns].conj()
        local = np.stack([np.angle(across).ravel(), np.angle(down).ravel()], 1) / (4 * np.pi)
        plane = np.stack(np.broadcast_arrays(1.0, x[columns], y[rows]), -1).reshape(-1, 3)
        fitted, *_ = np.linalg.lstsq(plane * weight[:, None], local * weight[:, None], rcond=None)
        rest = ((local - plane @ fitted) ** 2).sum(1)
        independent = max(4.0, plane.shape[0] * step**2 / (4 * np.pi * sigma_px**2))
        error = np.sqrt(np.average(rest, weights=weight**2) / independent)
        whole = frequency + fitted[0]
        corner = np.abs(fitted[1:]).T @ [width / 2, height / 2]
        length = float(np.hypot(*whole))
        variation = float(np.hypot(*corner)) / length
        return cls(whole, float(weight.mean()), float(error) / length, variation)
