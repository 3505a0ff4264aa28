"""A three-dimensional table from the change of three channels to a slope (the papers' LUT)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Complex64, Float32

BINS = 80
"""Entries per channel, as in the papers."""

_STRIDE = 256
_LARGEST_BYTE = 255


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
        """An axis that covers nearly all of (N, 3) changes, or as many of them as a byte can."""
        low, high = (float(v) for v in np.percentile(changes, [0.02, 99.98]))
        margin = 0.03 * (high - low) + 1e-3
        finest = _LARGEST_BYTE / (1 + high + margin)
        per_unit = min((count - 1) / (high - low + 2 * margin), finest)
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
        return np.asarray(np.clip(position, 0, self.last), np.float32)


@dataclass(frozen=True, eq=False)
class ColourTable:
    """Slopes by relative change of three channels.

    Attributes
    ----------
    axis : Axis
    normal_xy : (B, B, B) complex64
        Sine of the slope along x + i · along y; the axes are the channels in order.
    points : int
        On about so many points of an image the dependence on the place is to be added.
    """

    axis: Axis
    normal_xy: Complex64
    points: int = 1_200

    def bins(self, change: Float32) -> NDArray[np.uint8]:
        """Nearest entry of each channel for (..., 3) changes."""
        return np.rint(self.axis.position(change)).astype(np.uint8)

    def nearest(self, change: Float32) -> Float32:
        """(N, 2) sines of the entries nearest to (N, 3) changes."""
        first, second, third = self.bins(change).T
        entries = self.normal_xy[first, second, third]
        return np.stack([entries.real, entries.imag], axis=1)

    def flat(self) -> Complex64:
        """The table with its axes padded to 256, so that three bytes are its index.

        The pages between are never touched and cost no memory.
        """
        n = self.axis.count
        padded = np.zeros((n, _STRIDE, _STRIDE), np.complex64)
        # The first channel is the lowest byte, so that it must be the fastest axis.
        padded[:, :n, :n] = self.normal_xy.transpose(2, 1, 0)
        return padded.reshape(-1)


def as_complex(normal_xy: Float32) -> Complex64:
    """(...,) complex64 from (..., 2) sines."""
    return np.ascontiguousarray(normal_xy, np.float32).view(np.complex64)[..., 0]


def bake(model: Callable[[Float32], Float32], axis: Axis, aspect: float = 0.75) -> ColourTable:
    """Tabulate a model of (change, place) → sines, averaged over a few places.

    The model is evaluated at every other entry and interpolated between, for it is smooth on the
    scale of an entry.

    Parameters
    ----------
    model : callable
        (N, 5) float32 changes and place → (N, 2) float32 sines.
    axis : Axis
    aspect : float
        Height of the image over its width.
    """
    from scipy.ndimage import zoom

    nodes = axis.count // 2 + 1
    steps = 2 * np.arange(nodes, dtype=np.float32) + np.float32(axis.first)
    values = steps / np.float32(axis.per_unit) - 1
    changes = np.stack(np.meshgrid(values, values, values, indexing="ij"), -1).reshape(-1, 3)
    places = [(0.0, 0.0), *((x, y * aspect) for x in (-0.6, 0.6) for y in (-0.6, 0.6))]
    total = np.zeros((len(changes), 2), np.float32)
    for where in places:
        spot = np.broadcast_to(np.asarray(where, np.float32), (len(changes), 2))
        total += model(np.concatenate([changes, spot], 1))
    normal_xy = as_complex(total / np.float32(len(places))).reshape((nodes,) * 3)
    finer = zoom(normal_xy, (2 * nodes - 1) / nodes, order=1, mode="nearest")
    return ColourTable(axis, np.ascontiguousarray(finer[(slice(axis.count),) * 3]))
