"""What peers do from images to slopes and heights, for :mod:`bench_peers`.

Written here from their published descriptions, plainly and vectorised, in numpy and scipy. It is no
peer's code; a peer's own may be slower (a loop, PyTorch on a processor) or faster.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, dst, idctn, idst
from scipy.interpolate import griddata

Array = NDArray[Any]

HIDDEN = (32, 32, 32)
BINS = 80


def divergence(gx: Array, gy: Array) -> Array:
    """Central differences of a field of slopes, repeated at the border."""
    x = np.pad(gx, ((0, 0), (1, 1)), "edge")
    y = np.pad(gy, ((1, 1), (0, 0)), "edge")
    return np.asarray((x[:, 2:] - x[:, :-2] + y[2:] - y[:-2]) / 2)


def eigenvalues(shape: tuple[int, int], first: int, period: tuple[int, int]) -> Array:
    """Of the five-point Laplacian, one for each pair of frequencies."""
    rows, columns = (
        2 * np.cos(np.pi * np.arange(first, first + n) / p) - 2
        for n, p in zip(shape, period, strict=True)
    )
    return np.asarray(rows[:, None] + columns)


def poisson_by_cosines(gx: Array, gy: Array) -> Array:
    """Free border: cosine transforms both ways, eigenvalues made anew (the gs_sdk kind)."""
    spectrum = dctn(divergence(gx, gy), type=2)
    values = eigenvalues(gx.shape, 0, gx.shape)
    values[0, 0] = 1
    spectrum /= values
    spectrum[0, 0] = 0
    return np.asarray(idctn(spectrum, type=2))


def poisson_by_sines(gx: Array, gy: Array) -> Array:
    """Border held at 0: sine transforms of columns, then of rows (the "fast Poisson" of 2006)."""
    inner = divergence(gx, gy)[1:-1, 1:-1]
    period = (inner.shape[0] + 1, inner.shape[1] + 1)
    spectrum = dst(dst(inner, type=1, axis=0), type=1, axis=1)
    spectrum /= eigenvalues(inner.shape, 1, period)
    height = np.zeros(gx.shape)
    height[1:-1, 1:-1] = idst(idst(spectrum, type=1, axis=1), type=1, axis=0)
    return height


class PerPixelNetwork:
    """Colour and place of each pixel to two angles (gs_sdk); the weights do not matter for time."""

    def __init__(self, reference: Array) -> None:
        rng = np.random.default_rng(0)
        sizes = (5, *HIDDEN, 2)
        self.layers = [
            (rng.normal(0, n**-0.5, (n, m)).astype(np.float32), np.zeros(m, np.float32))
            for n, m in pairwise(sizes)
        ]
        self.level = self.angles(reference)

    def angles(self, image: Array) -> Array:
        """(H, W, 2)."""
        height, width = image.shape[:2]
        y, x = np.mgrid[:height, :width].astype(np.float32)
        place = np.stack([x / width, y / height], 2)
        values = np.concatenate([image.astype(np.float32) / 255, place], 2).reshape(-1, 5)
        for weights, bias in self.layers[:-1]:
            values = values @ weights
            values += bias
            np.maximum(values, 0, out=values)
        weights, bias = self.layers[-1]
        return np.asarray((values @ weights + bias).reshape(height, width, 2))

    def height(self, image: Array) -> Array:
        """Slopes are tangents of the angles, less those of the untouched skin."""
        slopes = np.tan(self.angles(image)) - np.tan(self.level)
        return poisson_by_cosines(slopes[..., 0], slopes[..., 1])


class Table:
    """Colour change to slope by bins; averaged over presses, empty bins by the nearest filled."""

    def __init__(self, changes: Array, slopes: Array) -> None:
        places = self.bins(changes)
        sums, counts = np.zeros((BINS, BINS, BINS, 2)), np.zeros((BINS, BINS, BINS))
        np.add.at(sums, tuple(places.T), slopes)
        np.add.at(counts, tuple(places.T), 1)
        filled = counts > 0
        known = sums[filled] / counts[filled, None]
        self.table = sums
        self.table[filled] = known
        self.table[~filled] = griddata(np.argwhere(filled), known, np.argwhere(~filled), "nearest")

    @staticmethod
    def bins(changes: Array) -> Array:
        """Of changes from −127 to 127."""
        return np.clip((changes + 127) * (BINS / 255), 0, BINS - 1).astype(int)

    def height(self, image: Array, reference: Array) -> Array:
        """Look up every pixel, then integrate with the border held."""
        at = self.bins(image.astype(float) - reference)
        slopes = self.table[at[..., 0], at[..., 1], at[..., 2]]
        return poisson_by_sines(slopes[..., 0], slopes[..., 1])


def stereo(images: Array, lights: Array) -> Array:
    """(H, W, 3) albedo times normal of K images: least squares over all pixels at once."""
    flat = images.reshape(-1, images.shape[2]).T.astype(float)
    solved, *_ = np.linalg.lstsq(lights, flat, rcond=None)
    return np.asarray(solved.T.reshape(*images.shape[:2], 3))
