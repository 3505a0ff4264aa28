"""Methods of other projects from images to slopes and heights, for :mod:`bench_peers`.

Vectorised numpy and scipy implementations from the published descriptions. None of this is another
project's code, which may be slower (a loop, PyTorch on a processor) or faster.
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
    """Divergence of a slope field by central differences, replicated at the border."""
    x = np.pad(gx, ((0, 0), (1, 1)), "edge")
    y = np.pad(gy, ((1, 1), (0, 0)), "edge")
    return np.asarray((x[:, 2:] - x[:, :-2] + y[2:] - y[:-2]) / 2)


def eigenvalues(shape: tuple[int, int], first: int, period: tuple[int, int]) -> Array:
    """Eigenvalues of the five-point Laplacian, one per pair of frequencies."""
    rows, columns = (
        2 * np.cos(np.pi * np.arange(first, first + n) / p) - 2
        for n, p in zip(shape, period, strict=True)
    )
    return np.asarray(rows[:, None] + columns)


def poisson_by_cosines(gx: Array, gy: Array) -> Array:
    """Neumann boundary: cosine transforms, eigenvalues computed in every call (as in gs_sdk)."""
    spectrum = dctn(divergence(gx, gy), type=2)
    values = eigenvalues(gx.shape, 0, gx.shape)
    values[0, 0] = 1
    spectrum /= values
    spectrum[0, 0] = 0
    return np.asarray(idctn(spectrum, type=2))


def poisson_by_sines(gx: Array, gy: Array) -> Array:
    """Dirichlet boundary: sine transforms of columns, then of rows ("fast Poisson", 2006)."""
    inner = divergence(gx, gy)[1:-1, 1:-1]
    period = (inner.shape[0] + 1, inner.shape[1] + 1)
    spectrum = dst(dst(inner, type=1, axis=0), type=1, axis=1)
    spectrum /= eigenvalues(inner.shape, 1, period)
    height = np.zeros(gx.shape)
    height[1:-1, 1:-1] = idst(idst(spectrum, type=1, axis=1), type=1, axis=0)
    return height


class PerPixelNetwork:
    """Network from colour and position of a pixel to two angles (gs_sdk), with random weights."""

    def __init__(self, reference: Array) -> None:
        rng = np.random.default_rng(0)
        sizes = (5, *HIDDEN, 2)
        self.layers = [
            (rng.normal(0, n**-0.5, (n, m)).astype(np.float32), np.zeros(m, np.float32))
            for n, m in pairwise(sizes)
        ]
        self.level = self.angles(reference)

    def angles(self, image: Array) -> Array:
        """(H, W, 2) angles of the gradient."""
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
        """(H, W) height; slopes are tangents of the angles, minus those of the reference."""
        slopes = np.tan(self.angles(image)) - np.tan(self.level)
        return poisson_by_cosines(slopes[..., 0], slopes[..., 1])


class Table:
    """Lookup table from colour change to slope: mean per bin, empty bins by nearest neighbour."""

    def __init__(self, changes: Array, slopes: Array) -> None:
        places = self.bins(changes)
        sums, counts = np.zeros((BINS, BINS, BINS, 2)), np.zeros((BINS, BINS, BINS))
        np.add.at(sums, tuple(places.T), slopes)
        np.add.at(counts, tuple(places.T), 1)
        filled = counts > 0
        means = sums[filled] / counts[filled, None]
        self.table = sums
        self.table[filled] = means
        self.table[~filled] = griddata(np.argwhere(filled), means, np.argwhere(~filled), "nearest")

    @staticmethod
    def bins(changes: Array) -> Array:
        """Bin indices of changes from −127 to 127."""
        return np.clip((changes + 127) * (BINS / 255), 0, BINS - 1).astype(int)

    def height(self, image: Array, reference: Array) -> Array:
        """Look up every pixel, then integrate with a Dirichlet boundary."""
        at = self.bins(image.astype(float) - reference)
        slopes = self.table[at[..., 0], at[..., 1], at[..., 2]]
        return poisson_by_sines(slopes[..., 0], slopes[..., 1])


def stereo(images: Array, lights: Array) -> Array:
    """(H, W, 3) albedo times normal from K images: least squares for all pixels at once."""
    flat = images.reshape(-1, images.shape[2]).T.astype(float)
    solved, *_ = np.linalg.lstsq(lights, flat, rcond=None)
    return np.asarray(solved.T.reshape(*images.shape[:2], 3))
