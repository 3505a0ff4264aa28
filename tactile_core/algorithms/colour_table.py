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


@dataclass(frozen=True)
class Axis:
    """How a channel's change is counted in entries; the same for every channel.

    Entry ``i`` stands for the ratio I / I₀ = (first + i) / per_unit, so that a ratio multiplied by
    ``per_unit`` and rounded to a byte is an entry's number plus ``first``.

    Attributes
    ----------
    per_unit : float
        Entries per unit of I / I₀.
    first : int
    count : int
    """

    per_unit: float
    first: int
    count: int = BINS

    @classmethod
    def spanning(cls, changes: Float32, count: int = BINS) -> Axis:
        """An axis that covers nearly all of (N, 3) changes."""
        low, high = (float(v) for v in np.percentile(changes, [0.02, 99.98]))
        margin = 0.03 * (high - low) + 1e-3
        per_unit = (count - 1) / (high - low + 2 * margin)
        return cls(per_unit, max(0, round((1 + low - margin) * per_unit)), count)

    @property
    def last(self) -> int:
        """Number of the last entry."""
        return self.count - 1

    def values(self) -> Float32:
        """(count,) change that each entry stands for."""
        steps = np.arange(self.count, dtype=np.float32) + np.float32(self.first)
        return np.asarray(steps / np.float32(self.per_unit) - 1, np.float32)

    def position(self, change: Float32) -> Float32:
        """Where changes lie between the entries, 0 … count − 1."""
        position = (change + 1) * np.float32(self.per_unit) - np.float32(self.first)
        return np.asarray(np.clip(position, 0, self.count - 1), np.float32)


@dataclass(frozen=True, eq=False)
class ColourTable:
    """Slopes by relative change of three channels.

    Attributes
    ----------
    axis : Axis
    slopes : (B, B, B) complex64
        ∂z/∂x + i·∂z/∂y; the axes are the channels in order.
    """

    axis: Axis
    slopes: Complex64

    def bins(self, change: Float32) -> NDArray[np.uint8]:
        """Nearest entry of each channel for (..., 3) changes."""
        return np.rint(self.axis.position(change)).astype(np.uint8)

    def flat(self) -> Complex64:
        """The table with its axes padded to 256, so that three bytes are its index.

        The pages between are never touched and cost no memory.
        """
        n = self.axis.count
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


def bake(model: Callable[[Float32], Float32], axis: Axis) -> ColourTable:
    """Tabulate a model of (change, place) → sines, averaged over a few places."""
    values = axis.values()
    grid = np.meshgrid(values, values, values, indexing="ij")
    changes = np.stack(grid, -1).reshape(-1, 3)
    total = np.zeros((len(changes), 2), np.float32)
    for where in _PLACES:
        spot = np.broadcast_to(np.asarray(where, np.float32), (len(changes), 2))
        total += to_gradient(model(np.concatenate([changes, spot], 1)))
    slopes = as_complex(total / np.float32(len(_PLACES)))
    return ColourTable(axis, slopes.reshape((axis.count,) * 3))
