"""The image as the skin sees it: every frame drawn back to where the marks were at rest."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.markers import marker_mask
from tactile_core.algorithms.shrinking import shrunk
from tactile_core.errors import InputError

Array = NDArray[Any]
Bool = NDArray[np.bool_]
Float32 = NDArray[np.float32]

_WIDTH_PX = 160
_NODE_PX = 8
_REACH_PITCHES = 0.8
_STIFFNESS = 0.05
_RIM_DIAMETERS = 0.25
_NEIGHBOURHOOD_DIAMETERS = 4.0
_LEAST_NEIGHBOURHOOD_PX = 9
_DARKEST = 1.0
_GRAIN_PX = 3
_FEWEST_MARKS = 3


class SkinView:
    """Draws frames back along the marks and keeps what the object printed between them.

    A point of the view is a point of the skin, whatever drags it. While the object sticks, its
    imprint moves with the skin and the view stands still.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)
        The skin where the marks are at ``reference_px``.
    reference_px : (N, 2)
        Their x and y; at least three.
    diameter_px : float
        Size of a mark.
    """

    def __init__(self, pixels: Array, reference_px: Array, diameter_px: float) -> None:
        if len(reference_px) < _FEWEST_MARKS:
            raise InputError(
                f"{len(reference_px)} marks do not tell how the skin moves; follow at least "
                f"{_FEWEST_MARKS}, or leave the imprint out"
            )
        self.times = max(1, round(pixels.shape[1] / _WIDTH_PX))
        first = _reduced(pixels, self.times)
        height, width = first.shape[:2]
        self._marks_px = _at(reference_px, self.times)
        diameter_px /= self.times
        self._columns, self._rows = np.meshgrid(
            np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
        )
        self._spread, self._nodes = _spread(self._marks_px, height, width)
        rim = 2 * int(np.ceil(_RIM_DIAMETERS * diameter_px)) + 1
        dark = marker_mask(pixels, diameter_px=diameter_px * self.times).astype(np.uint8)
        dark = cv2.resize(dark * 255, (width, height), interpolation=cv2.INTER_AREA)
        self._hidden = cv2.dilate(dark, np.ones((rim, rim), np.uint8)) > 64
        side = _NEIGHBOURHOOD_DIAMETERS * diameter_px
        self._side = max(_LEAST_NEIGHBOURHOOD_PX, 2 * int(side / 2) + 1)

    def imprint(self, pixels: Array, px: Array) -> tuple[Float32, Float32]:
        """Draw a frame back and leave what is finer than the spaces between the marks.

        Parameters
        ----------
        pixels : (H, W) or (H, W, K)
            The frame.
        px : (N, 2)
            Where the marks are in it.

        Returns
        -------
        (h, w, K) and (h, w) float32
            Light above or below its neighbourhood, as a share of it, 0 where nothing is seen; and
            1 where something is.
        """
        frame = _reduced(pixels, self.times)
        moved = self._spread @ (_at(px, self.times) - self._marks_px)
        moved = cv2.resize(moved.reshape(*self._nodes, 2), frame.shape[1::-1])
        x, y = self._columns + moved[..., 0], self._rows + moved[..., 1]
        drawn = cv2.remap(frame, x, y, cv2.INTER_LINEAR)
        within = (x >= 0) & (y >= 0) & (x <= frame.shape[1] - 1) & (y <= frame.shape[0] - 1)
        seen = (within & ~self._hidden).astype(np.float32)
        return _relief(drawn.reshape(*frame.shape[:2], -1), seen, self._side), seen


def _relief(drawn: Float32, seen: Float32, side: int) -> Float32:
    weight = seen[..., np.newaxis]
    count = cv2.blur(seen, (side, side))
    mean = cv2.blur(drawn * weight, (side, side)).reshape(drawn.shape)
    mean /= np.maximum(count, 1e-6)[..., np.newaxis]
    relief = cv2.blur((drawn / np.maximum(mean, _DARKEST) - 1) * weight, (_GRAIN_PX, _GRAIN_PX))
    return relief.reshape(drawn.shape) * weight


def _reduced(pixels: Array, times: int) -> Float32:
    size = pixels.shape[1] // times, pixels.shape[0] // times
    return shrunk(pixels, size).astype(np.float32)


def _at(points_px: Array, times: int) -> Float32:
    return (np.asarray(points_px, np.float32) + 0.5) / times - 0.5


def _spread(marks_px: Float32, height: int, width: int) -> tuple[Float32, tuple[int, int]]:
    """(G, N) weights that spread a value of each mark over a grid of nodes, locally linear."""
    rows, columns = -(-height // _NODE_PX), -(-width // _NODE_PX)
    x, y = np.meshgrid(
        (np.arange(columns) + 0.5) * width / columns - 0.5,
        (np.arange(rows) + 0.5) * height / rows - 0.5,
    )
    apart = np.stack(
        [marks_px[:, 0] - x.reshape(-1, 1), marks_px[:, 1] - y.reshape(-1, 1)], axis=-1
    )
    between = np.linalg.norm(marks_px[:, np.newaxis] - marks_px, axis=-1)
    np.fill_diagonal(between, np.inf)
    pitch_px = float(np.median(between.min(axis=1)))
    near = np.exp(-np.square(apart).sum(-1) / (2 * (_REACH_PITCHES * pitch_px) ** 2)) + 1e-12
    basis = np.concatenate([np.ones((*near.shape, 1)), apart / pitch_px], axis=-1)
    weighted = basis * near[..., np.newaxis]
    normal = np.swapaxes(basis, 1, 2) @ weighted + np.diag([1e-9, _STIFFNESS, _STIFFNESS])
    weights = np.linalg.solve(normal, np.swapaxes(weighted, 1, 2))[:, 0]
    return weights.astype(np.float32), (rows, columns)
