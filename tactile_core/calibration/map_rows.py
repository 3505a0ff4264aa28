"""Bands of a height map's rows: fitted on, or held out to be scored."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.calibration.height_target import HeightTarget
from tactile_core.errors import InputError
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Bool, Float32, Frame, Reference

MOST_BLOCKS = 5
ROWS_PER_BLOCK = 20

_MOST_PIXELS = 5_000
_SLOPE_BIN_DEG = 2.5
_FINE_PX = 4.0
"""Shapes finer than this tell the light's direction: a background may have eaten larger ones."""

_LEAST_INTENSITY = 0.01


@dataclass(frozen=True, eq=False)
class MapBlock:
    """A band of a height map's rows, as a known surface.

    Attributes
    ----------
    target : HeightTarget
    first, last : int
        Rows of the target, half-open.
    """

    target: HeightTarget
    first: int
    last: int

    @property
    def file(self) -> str:
        """The map and the rows of the image."""
        top = self.target.first_row
        return f"{self.target.file} {top + self.first}:{top + self.last}"

    @property
    def frame(self) -> Frame:
        """The observation that shows the surface."""
        return self.target.frame

    @property
    def used(self) -> bool:
        """Whether the map knows any height here."""
        return bool(self.scored().any())

    @property
    def why(self) -> str:
        """Why it is not used."""
        return "" if self.used else "the map holds no heights here"

    @property
    def centre_px(self) -> tuple[float, float]:
        """Middle of the band."""
        middle = self.target.first_row + (self.first + self.last - 1) / 2
        return (self.frame.pixels.shape[1] - 1) / 2, middle

    @property
    def radius_px(self) -> float:
        """Of a circle as large as the band."""
        return float(np.sqrt((self.last - self.first) * self.frame.pixels.shape[1] / np.pi))

    def area(self) -> Bool:
        """(H, W) bool: the band."""
        return self._in_frame(self._band(0))

    def scored(self) -> Bool:
        """(H, W) bool: usable pixels, away from the neighbouring bands."""
        return self._in_frame(self.target.usable & self._band(self.target.margin_px))

    def training(self) -> Press:
        """Usable pixels, thinned so that level land does not outweigh the walls.

        A pixel's chance goes with the root of how rare its slope is: with the frequency itself the
        few steepest pixels, which the map knows worst, would rule.
        """
        rows, columns = np.nonzero(self.scored())
        gx, gy = (
            plane[rows - self.target.first_row, columns] for plane in self.target.smooth_slopes
        )
        slope_deg = np.degrees(np.arctan(np.hypot(gx, gy)))
        bins = (slope_deg / _SLOPE_BIN_DEG).astype(int)
        chance = np.bincount(bins).astype(np.float64)[bins] ** -0.5
        count = min(_MOST_PIXELS, len(rows))
        pick = np.random.default_rng(0).choice(
            len(rows), count, replace=False, p=chance / chance.sum()
        )
        return Press(
            frame=self.frame,
            rows=rows[pick].astype(np.int32),
            columns=columns[pick].astype(np.int32),
            gradients=np.stack([gx, gy], axis=1)[pick].astype(np.float32),
            name=self.file,
            heights_mm=self.target.smooth_relief_mm[rows - self.target.first_row, columns][pick],
        )

    def true_gradients(self, mask: Bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and (N, 2) slopes of the map over a mask."""
        rows, columns = np.nonzero(mask)
        gx, gy = (plane[rows - self.target.first_row, columns] for plane in self.target.slopes)
        return rows, columns, np.stack([gx, gy], axis=1)

    def height_errors_mm(self, height_mm: Float32, mask: Bool) -> np.ndarray:
        """(N,) measured minus true height over a mask, up to a plane: the map's is arbitrary."""
        rows, columns = np.nonzero(mask)
        true = self.target.height_mm[rows - self.target.first_row, columns]
        error = height_mm[mask].astype(np.float64) - true
        plane = np.stack([np.ones(len(rows)), rows, columns], axis=1)
        return np.asarray(error - plane @ np.linalg.lstsq(plane, error, rcond=None)[0])

    def lighting(self, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
        """Slopes and changes of intensity of what is fine in the relief."""
        top = self.target.first_row
        band = slice(top, top + len(self.target.height_mm))
        base = reference.pixels[band]
        floor = np.float32(_LEAST_INTENSITY * self.frame.full_scale)
        change = self.frame.pixels[band] / np.maximum(base, floor) - np.float32(1)
        at = (self.target.usable & self._band(self.target.margin_px)).nonzero()
        slopes = np.stack(self.target.slopes, axis=2)
        return _fine(slopes)[at], _fine(change.astype(np.float32))[at]

    def _band(self, margin_px: int) -> Bool:
        band = np.zeros(self.target.height_mm.shape, np.bool_)
        band[self.first + margin_px : max(self.first, self.last - margin_px)] = True
        return band

    def _in_frame(self, part: Bool) -> Bool:
        whole = np.zeros(self.frame.pixels.shape[:2], np.bool_)
        whole[self.target.first_row : self.target.first_row + len(part)] = part
        return whole


def blocks(target: HeightTarget) -> list[MapBlock]:
    """Divide a target into bands that hold heights.

    Raises
    ------
    InputError
        None does.
    """
    count = min(MOST_BLOCKS, max(1, len(target.height_mm) // ROWS_PER_BLOCK))
    edges = [round(len(target.height_mm) * i / count) for i in range(count + 1)]
    bands = [MapBlock(target, a, b) for a, b in pairwise(edges)]
    used = [band for band in bands if band.used]
    if not used:
        raise InputError(f"{target.file} holds no heights in these rows; choose others")
    return used


def _fine(planes: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(planes - cv2.GaussianBlur(planes, (0, 0), _FINE_PX), np.float32)
