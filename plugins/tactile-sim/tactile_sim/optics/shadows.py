"""Shadows that the relief of the gel surface casts on itself, by ray marching."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32

# [ratio] A ray can be hidden only near a slope of at least this share of its own rise: the mean
# value theorem gives 1; OpenCV rounds positions to 1/32 pixel, which is at most 0.022 of a step
_STEEPNESS = 0.97
# [rows] Positions along the rays that OpenCV reads in one call, in rows of the grid: at most 32767,
# which is OpenCV's limit
_ROWS_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class Shadows:
    """Rays from each point of the gel surface towards one light, on a reduced grid.

    Attributes
    ----------
    way : (2, h, w) float32
        Direction towards the light in the image plane, unit vectors.
    rise : (h, w) float32
        Height that a ray gains per mm in the image plane.
    blur : float
        Half the angle that the light subtends, rad: the penumbra.
    mm_per_px : float
        Scale of the reduced grid.
    """

    way: Float32
    rise: Float32
    blur: float
    mm_per_px: float

    @classmethod
    def prepare(cls, toward: Float32, blur: float, *, mm_per_px: float, reduce: int) -> Shadows:
        """Prepare the (3, H, W) field of one light for a grid that is ``reduce`` times coarser."""
        h, w = toward.shape[1:]
        size = (max(1, w // reduce), max(1, h // reduce))
        x, y, z = (cv2.resize(plane, size, interpolation=cv2.INTER_AREA) for plane in toward)
        level = np.maximum(np.hypot(x, y), 1e-6)
        rise = np.maximum(z / level, 1e-3)  # [ratio] bounds the length of shadows at grazing light
        return cls(np.stack([x / level, y / level]), rise, blur, mm_per_px * w / size[0])

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the reduced grid."""
        return self.rise.shape[1], self.rise.shape[0]

    @cached_property
    def lowest_rise(self) -> float:
        """Rise of the flattest ray."""
        return float(self.rise.min())

    def march_over(self, relief_mm: float) -> tuple[int, float]:
        """Return the number of steps of a ray over this relief, and their length in pixels."""
        reach_px = relief_mm / self.lowest_rise / self.mm_per_px
        reach_px = min(reach_px, float(np.hypot(*self.rise.shape)))
        steps = int(np.clip(np.ceil(reach_px), 1, 16))  # [count] along a ray
        return steps, max(reach_px / steps, 1.0)


def cast(lights: Sequence[Shadows], low: Float32, shape: tuple[int, int]) -> list[Float32] | None:
    """Return the (H, W) share of each light that arrives; None without any shadow.

    Parameters
    ----------
    lights : sequence of Shadows
        At least one; all on the same reduced grid.
    low : (h, w) float32
        Relief above the undeformed surface in mm, on that grid.
    shape : (H, W)
        Size of the image.
    """
    relief_mm, mm_per_px = float(low.max() - low.min()), lights[0].mm_per_px
    marches = [light.march_over(relief_mm) for light in lights]
    lowest_rise = min(light.lowest_rise for light in lights)
    reach_px = max(steps * stride_px for steps, stride_px in marches)
    part = _near_steep(low, _STEEPNESS * lowest_rise * mm_per_px, int(np.ceil(reach_px)) + 1)
    if part is None:
        return None
    hidden = _hidden_share(lights, marches, low, part)
    if hidden.max() <= 0:
        return None
    lit = np.ones((len(lights), *low.shape), np.float32)
    lit[:, *part] = 1 - np.minimum(hidden, 1)
    return [np.asarray(cv2.resize(one, shape[::-1]), np.float32) for one in lit]


def _hidden_share(
    lights: Sequence[Shadows],
    marches: Sequence[tuple[int, float]],
    low: Float32,
    part: tuple[slice, slice],
) -> Float32:
    """(L, n, m) hidden share of each light in a part of the grid; above 1 where it is far below."""
    near = low[part]
    size = len(lights), *near.shape
    # x, y and height along the rays: change per step, and start
    rays = np.empty((3, 2, *size), np.float32)
    for number, (light, (_, stride_px)) in enumerate(zip(lights, marches, strict=True)):
        np.multiply(light.way[:, *part], stride_px, out=rays[:2, 0, number])
        np.multiply(light.rise[part], stride_px * light.mm_per_px, out=rays[2, 0, number])
    rays[0, 1] = np.arange(part[1].start, part[1].stop)
    rays[1, 1] = np.arange(part[0].start, part[0].stop)[:, None]
    rays[2, 1] = near
    most = max(steps for steps, _ in marches)
    step = np.ones((most, 2), np.float32)
    step[:, 0] = np.arange(1, most + 1)
    # Height of the relief above the ray to the light's centre, relative to the half height of the
    # light at this distance; 0 behind the last step of a light.
    scale = np.zeros((most, len(lights), 1, 1), np.float32)
    for number, (light, (steps, stride_px)) in enumerate(zip(lights, marches, strict=True)):
        half = stride_px * light.mm_per_px * light.blur
        scale[:steps, number, 0, 0] = 1 / (step[:steps, 0] * half)
    hidden = np.zeros(size, np.float32)
    # steps and lights are planes below each other, so that one call of OpenCV serves all
    at_once = max(1, _ROWS_AT_ONCE // (size[0] * size[1]))
    for first in range(0, most, at_once):
        here = slice(first, first + at_once)
        x, y, ray = (step[here] @ rays.reshape(3, 2, -1)).reshape(3, -1, size[2])
        above = cv2.remap(low, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        over = np.asarray(cv2.subtract(above, ray), np.float32).reshape(-1, *size)
        over *= scale[here]
        np.maximum(hidden, over.max(0), out=hidden)
    return hidden


def _near_steep(low: Float32, least_mm: float, reach_px: int) -> tuple[slice, slice] | None:
    """Rows and columns within reach of cells that rise by at least this from pixel to pixel."""
    down, across = np.abs(np.diff(low, axis=0)), np.abs(np.diff(low, axis=1))
    # the slope inside a cell is between those of its sides
    down = np.maximum(down[:, 1:], down[:, :-1]) if low.shape[1] > 1 else down
    across = np.maximum(across[1:], across[:-1]) if low.shape[0] > 1 else across
    steep = np.asarray(down * down + across * across >= least_mm**2)
    if not steep.any():
        return None
    sides = []
    for axis, size in ((1, low.shape[0]), (0, low.shape[1])):
        cells = np.flatnonzero(steep.any(axis))
        first, last = int(cells[0]) - reach_px, int(cells[-1]) + 2 + reach_px
        sides.append(slice(max(first, 0), min(last, size)))
    return sides[0], sides[1]
