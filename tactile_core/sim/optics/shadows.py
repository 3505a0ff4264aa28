"""Shadows that the relief of the gel surface casts on itself, by ray marching."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32


class MarchingParameters(NamedTuple):
    """Ray marching towards a light.

    Attributes
    ----------
    max_steps : int, count
        Largest number of steps along a ray.
        Source: chosen by hand; no script derives it.
    min_rise : float, ratio
        Smallest height per distance of a ray. It bounds the length of shadows at grazing light.
        Source: chosen by hand; no script derives it.
    """

    max_steps: int = 16
    min_rise: float = 1e-3


MARCHING = MarchingParameters()
"""The values in use."""


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
        rise = np.maximum(z / level, MARCHING.min_rise)
        return cls(np.stack([x / level, y / level]), rise, blur, mm_per_px * w / size[0])

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the reduced grid."""
        return self.rise.shape[1], self.rise.shape[0]

    def cast(self, low: Float32, shape: tuple[int, int]) -> Float32 | None:
        """Return the visible share of the light at each pixel; None without any shadow.

        Parameters
        ----------
        low : (h, w) float32
            Relief above the undeformed surface in mm, on the reduced grid.
        shape : (H, W)
            Size of the image.

        Returns
        -------
        (H, W) float32 or None
        """
        rows, columns = low.shape
        relief_mm = float(low.max() - low.min())
        lowest_rise = float(self.rise.min())
        reach_px = min(relief_mm / lowest_rise / self.mm_per_px, float(np.hypot(rows, columns)))
        steps = int(np.clip(np.ceil(reach_px), 1, MARCHING.max_steps))
        stride_px = max(reach_px / steps, 1.0)
        x, y = np.meshgrid(np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32))
        stride_x, stride_y = self.way * np.float32(stride_px)
        stride_mm = np.float32(stride_px * self.mm_per_px)
        ray = low.copy()
        climb = self.rise * stride_mm
        hidden = np.zeros_like(low)
        for step in range(1, steps + 1):
            x += stride_x
            y += stride_y
            ray += climb
            above = np.asarray(
                cv2.remap(low, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
                np.float32,
            )
            above -= ray
            # Height of the relief above the ray to the light's centre, relative to the half
            # height of the light at this distance.
            above *= np.float32(1 / (step * stride_mm * self.blur))
            np.maximum(hidden, above, out=hidden)
        if hidden.max() <= 0:
            return None
        seen = 1 - np.minimum(hidden, 1)
        return np.asarray(cv2.resize(seen, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)
