"""Three-dimensional lookup table from the relative change of three channels to a slope."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Complex64, Float32, as_complex


class TABLE:
    """Parameters of lookup tables. The number of entries is an option of ``core.lookup_table``.

    Nothing sets the others from outside: they depend on no sensor.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: high-resolution robot tactile sensors for
       estimating geometry and force", Sensors 17(12), 2017, sections 3.3 and 3.5.
    """

    # [count] Default number of entries per channel. Source: [1]_, section 3.5: 80 × 80 × 80
    # entries.
    bins = 80
    # [count] A model is evaluated at every 2^halvings-th entry, and interpolated between. Source:
    # the errors of held-out presses of four sets are within 0.1 % of those of 1 (ADR 6).
    halvings = 2


@dataclass(frozen=True)
class Axis:
    """Mapping from the relative change of a channel to entries, the same for every channel.

    Entry ``i`` is the ratio I / I₀ = (first + i) / per_unit. So a ratio multiplied by ``per_unit``
    and rounded to a byte is the index of an entry plus ``first``.

    Attributes
    ----------
    per_unit : float
        Entries per unit of I / I₀.
    first : int
        Ratio of the first entry, in entries.
    count : int
        Number of entries.
    """

    per_unit: float
    first: int
    count: int = TABLE.bins

    @classmethod
    def spanning(cls, changes: Float32, count: int = TABLE.bins) -> Axis:
        """Return an axis that covers nearly all of (N, 3) changes, as far as a byte allows."""
        ends = [0.02, 99.98]  # [percent] without the outliers of single pixels
        low, high = (float(v) for v in np.percentile(changes, ends))
        # [shares of that range] Equal changes have an axis, too
        margin = 0.03 * (high - low) + 1e-3
        finest = 255 / (1 + high + margin)  # of a byte
        per_unit = min((count - 1) / (high - low + 2 * margin), finest)
        return cls(per_unit, max(0, round((1 + low - margin) * per_unit)), count)

    @property
    def last(self) -> int:
        """Index of the last entry."""
        return self.count - 1

    def values(self) -> Float32:
        """Relative change at each entry, (count,)."""
        steps = np.arange(self.count, dtype=np.float32) + np.float32(self.first)
        return np.asarray(steps / np.float32(self.per_unit) - 1, np.float32)

    def position(self, change: Float32) -> Float32:
        """Position of changes along the axis, in entries from 0 to count − 1, not rounded."""
        position = (change + 1) * np.float32(self.per_unit) - np.float32(self.first)
        return np.asarray(np.clip(position, 0, self.last), np.float32)


@dataclass(frozen=True, eq=False)
class ColourTable:
    """Lookup table from the relative change of three channels to the unit normal.

    Attributes
    ----------
    axis : Axis
    normal_xy : (B, B, B) complex64
        x + i·y components of the unit normal; the axes are the channels in order.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: high-resolution robot tactile sensors for
       estimating geometry and force", Sensors 17(12), 2017, sections 3.3 and 3.5.
    """

    axis: Axis
    normal_xy: Complex64

    def bins(self, change: Float32) -> NDArray[np.uint8]:
        """Index of the nearest entry along each channel, for (..., 3) changes."""
        return np.rint(self.axis.position(change)).astype(np.uint8)

    def nearest(self, change: Float32) -> Float32:
        """Return (N, 2) ``normal_xy`` of the entries nearest to (N, 3) changes."""
        first, second, third = self.bins(change).T
        entries = self.normal_xy[first, second, third]
        return np.stack([entries.real, entries.imag], axis=1)


def bake(model: Callable[[Float32], Float32], axis: Axis, aspect: float = 0.75) -> ColourTable:
    """Tabulate a slope model, averaged over five places of the image.

    The model is smooth on the scale of some entries, so it is evaluated at a few and interpolated
    between.

    Parameters
    ----------
    model : callable
        (N, 5) float32 changes and position → (N, 2) float32 components of the unit normal.
    axis : Axis
    aspect : float
        Height of the image over its width.
    """
    step = 2**TABLE.halvings
    nodes = coarse_count(axis.count, TABLE.halvings)
    steps = step * np.arange(nodes, dtype=np.float32) + np.float32(axis.first)
    values = steps / np.float32(axis.per_unit) - 1
    changes = np.stack(np.meshgrid(values, values, values, indexing="ij"), -1).reshape(-1, 3)
    # [half widths of the image] The table is averaged over places this far from its centre
    ends = -0.6, 0.6
    places = [(0.0, 0.0), *((x, y * aspect) for x in ends for y in ends)]
    total = np.zeros((len(changes), 2), np.float32)
    for where in places:
        spot = np.broadcast_to(np.asarray(where, np.float32), (len(changes), 2))
        total += model(np.concatenate([changes, spot], 1))
    normal_xy = as_complex(total / np.float32(len(places))).reshape((nodes,) * 3)
    return ColourTable(axis, refine_table(normal_xy, axis.count, TABLE.halvings))


def coarse_count(count: int, halvings: int) -> int:
    """Number of entries per channel, each 2^halvings apart, that span ``count`` entries."""
    step: int = 2**halvings
    return -(-(count - 1) // step) + 1


def refine_table(coarse: Complex64, count: int, halvings: int) -> Complex64:
    """Interpolate entries that are 2^halvings apart to a whole table, (count, count, count).

    Each halving puts a cubic through the four nearest entries between each two [1]_.

    References
    ----------
    .. [1] N. Dyn, D. Levin and J. A. Gregory, "A 4-point interpolatory subdivision scheme for curve
       design", Computer Aided Geometric Design 4(4), 1987.
    """
    for _ in range(halvings):
        for axis in range(3):
            coarse = np.moveaxis(_insert_midpoints(np.moveaxis(coarse, axis, 0)), 0, axis)
    return np.ascontiguousarray(coarse[(slice(count),) * 3])


def _insert_midpoints(values: Complex64) -> Complex64:
    """Insert values between those along the first axis, (n, …) to (2 n − 1, …)."""
    finer = np.empty((2 * len(values) - 1, *values.shape[1:]), np.complex64)
    finer[::2] = values
    # a straight line continues the table at both ends
    before, after = 2 * values[:1] - values[1:2], 2 * values[-1:] - values[-2:-1]
    near = values[:-1] + values[1:]
    far = np.concatenate([before, values[:-2]]) + np.concatenate([values[2:], after])
    finer[1::2] = np.float32(9 / 16) * near - np.float32(1 / 16) * far
    return finer
