"""A three-dimensional table from the change of three channels to a slope (the papers' LUT)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Complex64 = NDArray[np.complex64]

BINS = 80
"""Entries per channel, as in the papers."""

STEEPEST_SINE = 0.98
"""Sine of the steepest slope that a model may claim."""

_STRIDE = 256
_PLACES = ((0.0, 0.0), (-0.6, -0.45), (0.6, -0.45), (-0.6, 0.45), (0.6, 0.45))


@dataclass(frozen=True, eq=False)
class ColourTable:
    """Slopes by relative change of three channels.

    Attributes
    ----------
    low, high : (3,) float32
        The changes that the first and the last entry begin and end at.
    slopes : (B, B, B) complex64
        ∂z/∂x + i·∂z/∂y; the axes are the channels in order.
    """

    low: Float32
    high: Float32
    slopes: Complex64

    def bins(self, change: Float32) -> NDArray[np.uint8]:
        """Entry of each channel for (..., 3) changes; the nearest where they lie outside."""
        n = self.slopes.shape[0]
        position = (change - self.low) * (n / (self.high - self.low))
        return np.asarray(np.clip(position, 0, n - 1), np.uint8)

    def flat(self) -> Complex64:
        """The table with its axes padded to 256, so that three bytes are its index.

        The pages between are never touched and cost no memory.
        """
        n = self.slopes.shape[0]
        padded = np.zeros((n, _STRIDE, _STRIDE), np.complex64)
        # The first channel is the lowest byte, so that it must be the fastest axis.
        padded[:, :n, :n] = self.slopes.transpose(2, 1, 0)
        return padded.reshape(-1)


def to_gradient(sines: Float32) -> Float32:
    """Slopes ∂z/∂(x, y) from (..., 2) sines, which are bounded by the steepest first.

    The sine is the horizontal part of the unit normal, turned uphill.
    """
    square = (sines * sines).sum(-1, keepdims=True)
    excess = np.maximum(square, STEEPEST_SINE**2) / STEEPEST_SINE**2
    bounded = sines / np.sqrt(excess)
    return np.asarray(bounded / np.sqrt(1 - np.minimum(square, STEEPEST_SINE**2)), np.float32)


def to_sines(gradients: Float32) -> Float32:
    """Sines from (..., 2) slopes; the inverse of :func:`to_gradient`."""
    norm = np.sqrt(1 + (gradients * gradients).sum(-1, keepdims=True))
    return np.asarray(gradients / norm, np.float32)


def as_complex(gradients: Float32) -> Complex64:
    """(...,) complex64 from (..., 2) slopes."""
    return np.ascontiguousarray(gradients, np.float32).view(np.complex64)[..., 0]


def span(changes: Float32) -> tuple[Float32, Float32]:
    """Range of (N, 3) changes with a margin, for a table."""
    low, high = np.percentile(changes, [0.05, 99.95], axis=0).astype(np.float32)
    margin = 0.03 * (high - low) + np.float32(1e-3)
    return low - margin, high + margin


def entries(low: Float32, high: Float32, bins: int = BINS) -> Float32:
    """(B³, 3) change at the middle of each entry, in the order of the table."""
    axes = [low[k] + (np.arange(bins) + 0.5) * (high[k] - low[k]) / bins for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3).astype(np.float32)


def bake(
    model: Callable[[Float32], Float32], low: Float32, high: Float32, bins: int = BINS
) -> ColourTable:
    """Tabulate a model of (change, place) → sines, averaged over a few places."""
    changes = entries(low, high, bins)
    total = np.zeros((len(changes), 2), np.float32)
    for where in _PLACES:
        spot = np.broadcast_to(np.asarray(where, np.float32), (len(changes), 2))
        total += to_gradient(model(np.concatenate([changes, spot], 1)))
    slopes = as_complex(total / np.float32(len(_PLACES)))
    return ColourTable(low, high, slopes.reshape(bins, bins, bins))
