"""The image as the skin sees it: every frame drawn back to where the markers were at rest."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.pitch import pitch
from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_core.algorithms.markers import marker_mask
from tactile_core.errors import InputError

_WIDTH_PX = 160
_NODE_PX = 8
_REACH_PITCHES = 0.8
_STIFFNESS = 0.05
_RIM_DIAMETERS = 0.25
_HIDDEN_SHARE = 0.25
_NEIGHBOURHOOD_PITCHES = 1.5
_GRAIN_PX = 3
_FEWEST_MARKERS = 3


class SurfaceView:
    """Draws frames back along the markers and keeps what the object printed between them.

    A point of the view is a point of the skin, whatever drags it. While the object sticks, its
    imprint moves with the skin and the view stands still.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)
        The skin where the markers are at ``reference_px``.
    reference_px : (N, 2)
        Their x and y; at least three.
    diameter_px : float
        Size of a marker.
    """

    def __init__(self, pixels: Array, reference_px: Array, diameter_px: float) -> None:
        if len(reference_px) < _FEWEST_MARKERS:
            raise InputError(
                f"{len(reference_px)} markers do not tell how the skin moves; follow at least "
                f"{_FEWEST_MARKERS}, or leave the imprint out"
            )
        self.times = max(1, round(pixels.shape[1] / _WIDTH_PX))
        first = _reduced(pixels, self.times)
        height, width = first.shape[:2]
        self._markers_px = _at(reference_px, self.times)
        diameter_px /= self.times
        self._columns, self._rows = np.meshgrid(
            np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
        )
        pitch_px = pitch(self._markers_px)
        self._spread, self._nodes = _spread(self._markers_px, pitch_px, height, width)
        rim = 2 * int(np.ceil(_RIM_DIAMETERS * diameter_px)) + 1
        mask = marker_mask(pixels, diameter_px=diameter_px * self.times)
        share = shrunk(mask.astype(np.float32), (width, height))
        self._hidden = cv2.dilate(share, np.ones((rim, rim), np.uint8)) > _HIDDEN_SHARE
        self._side = 2 * round(0.5 * _NEIGHBOURHOOD_PITCHES * pitch_px) + 1

    def imprint(self, pixels: Array, px: Array) -> tuple[Float32, Float32]:
        """Draw a frame back and leave what is finer than the spaces between the markers.

        Parameters
        ----------
        pixels : (H, W) or (H, W, K)
            The frame.
        px : (N, 2)
            Where the markers are in it.

        Returns
        -------
        pattern : (h, w, K) float32
            Light above or below its neighbourhood, as a share of it; 0 where nothing is seen.
        seen : (h, w) float32
            1 where something is.
        """
        frame = _reduced(pixels, self.times)
        height, width = frame.shape[:2]
        moved = self._spread @ (_at(px, self.times) - self._markers_px)
        x, y = (cv2.resize(along.reshape(self._nodes), (width, height)) for along in moved.T)
        x, y = cv2.add(self._columns, x, dst=x), cv2.add(self._rows, y, dst=y)
        drawn = np.asarray(cv2.remap(frame, x, y, cv2.INTER_LINEAR), np.float32)
        within = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
        seen = within & ~self._hidden
        pattern = _pattern(drawn.reshape(height, width, -1), seen, self._side)
        return pattern, seen.astype(np.float32)


def _pattern(drawn: Float32, seen: Bool, side: int) -> Float32:
    size, shape = (side, side), drawn.shape
    around = np.maximum(cv2.boxFilter(seen.view(np.uint8), cv2.CV_32F, size), 1e-6)
    # one weight for each channel, since broadcasting along so short an axis is slow
    weight, share = (
        np.asarray(cv2.merge([plane] * shape[2]), np.float32).reshape(shape)
        for plane in (seen.astype(np.float32), around)
    )
    drawn *= weight
    # a mean below an intensity of 1 counts as 1
    total = np.asarray(cv2.max(cv2.blur(drawn, size), share), np.float32).reshape(shape)
    drawn *= np.divide(share, total, out=total)
    drawn -= weight
    smooth = np.asarray(cv2.blur(drawn, (_GRAIN_PX, _GRAIN_PX)), np.float32).reshape(shape)
    smooth *= weight
    return smooth


def _reduced(pixels: Array, times: int) -> Float32:
    size = pixels.shape[1] // times, pixels.shape[0] // times
    return np.asarray(shrunk(pixels, size), np.float32)


def _at(points_px: Array, times: int) -> Float32:
    return np.asarray((np.asarray(points_px) + 0.5) / times - 0.5, np.float32)


def _spread(
    markers_px: Float32, pitch_px: float, height: int, width: int
) -> tuple[Float32, tuple[int, int]]:
    """(G, N) weights that spread a value of each marker over a grid of nodes, locally linear."""
    rows, columns = -(-height // _NODE_PX), -(-width // _NODE_PX)
    x, y = np.meshgrid(
        (np.arange(columns) + 0.5) * width / columns - 0.5,
        (np.arange(rows) + 0.5) * height / rows - 0.5,
    )
    apart = np.stack(
        [markers_px[:, 0] - x.reshape(-1, 1), markers_px[:, 1] - y.reshape(-1, 1)], axis=-1
    )
    near = np.exp(-np.square(apart).sum(-1) / (2 * (_REACH_PITCHES * pitch_px) ** 2)) + 1e-12
    basis = np.concatenate([np.ones((*near.shape, 1)), apart / pitch_px], axis=-1)
    weighted = basis * near[..., np.newaxis]
    normal = np.swapaxes(basis, 1, 2) @ weighted + np.diag([1e-9, _STIFFNESS, _STIFFNESS])
    weights = np.linalg.solve(normal, np.swapaxes(weighted, 1, 2))[:, 0]
    return weights.astype(np.float32), (rows, columns)
