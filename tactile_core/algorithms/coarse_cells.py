"""Images on a coarse grid of cells, and smooth fields that a contact does not move."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import shorths
from tactile_core.algorithms.arrays.types import Array, Bool

ROWS, COLUMNS = 20, 26  # Cells of the grid, count; each is the mean of 2 × 2 samples

FEWEST_CELLS = 60  # Cells that a comparison needs, count

DARKEST = 0.02  # Share of the full scale up to which a cell is too dark to compare

BRIGHTEST = 0.98  # Share of the full scale from which on a cell is too bright to compare


class Cells:
    """Means of an image's intensities on a coarse grid, without hidden pixels.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns of the image.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        rows, columns = (max(2, size // 4 * 2) for size in shape)
        self.shape = min(ROWS, rows), min(COLUMNS, columns)

    def log(self, pixels: Array, full_scale: float, hidden: Bool | None) -> tuple[Array, Bool]:
        """Return the logarithm of each cell's mean, and which cells are readable.

        Parameters
        ----------
        pixels : (H, W, K)
        full_scale : float
        hidden : (H, W) bool or None
            Pixels that do not show the gel surface, such as markers.

        Returns
        -------
        (K, N) float32, (N,) bool
        """
        if pixels.flags.c_contiguous:
            samples = self._samples(pixels).astype(np.float32)
        else:
            planes = [self._samples(plane) for plane in pixels.transpose(2, 0, 1)]
            samples = np.stack(planes, axis=-1).astype(np.float32)
        shown: Array | np.float32 = np.float32(1)
        if hidden is not None:
            shows = np.float32(1) - self._samples(hidden.view(np.uint8))
            samples *= shows[..., None]
            shown = self._means(shows).ravel()
        means = np.ascontiguousarray(self._means(samples).reshape(-1, samples.shape[2]).T)
        means /= np.maximum(shown, 0.25) * np.float32(full_scale)
        means += shown == 0  # a cell that markers hide is not readable, but it is not black
        readable = (means.min(axis=0) > DARKEST) & (means.max(axis=0) < BRIGHTEST)
        return np.log(np.maximum(means, DARKEST)), readable

    @staticmethod
    def black(log: Array) -> Bool:
        """Return which cells (N,) are dark in every channel, as no contact makes them."""
        return np.asarray(log.max(axis=0) <= np.log(np.float32(DARKEST)) + 1e-6)

    def _samples(self, image: Array) -> Array:
        """Return every n-th pixel, (2 R, 2 C) or (2 R, 2 C, K), alike from both ends."""
        size = 2 * self.shape[1], 2 * self.shape[0]
        return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_NEAREST_EXACT)).reshape(
            *size[::-1], *image.shape[2:]
        )

    def _means(self, samples: Array) -> Array:
        """Average (2 R, 2 C, …) samples over the four of each cell."""
        return np.asarray(cv2.resize(samples, self.shape[::-1], interpolation=cv2.INTER_AREA))


def fit_smooth_field(change: Array, basis: Array, scales: tuple[float, ...]) -> Array:
    """Fit a smooth field to the cells that agree with it; a contact is ignored.

    Iteratively reweighted least squares with Tukey's biweight, whose scale shrinks [1]_, from the
    densest half of each channel.

    Parameters
    ----------
    change : (K, N)
    basis : (M, N)
        Row 0 is 1.
    scales : sequence of float
        Decreasing.

    Returns
    -------
    (K, M)

    References
    ----------
    .. [1] A. Blake and A. Zisserman, "Visual Reconstruction", MIT Press, 1987 (graduated
       non-convexity).
    """
    coefficients = np.zeros((len(change), len(basis)), np.float32)
    coefficients[:, 0] = shorths(change)
    ridge = 1e-4 * np.eye(len(basis), dtype=np.float32)
    for scale in scales:
        square = np.square(change - coefficients @ basis).mean(axis=0)
        weight = np.maximum(1 - square / (4 * scale * scale), 0) ** 2 + 1e-4
        weighted = basis * weight
        coefficients = np.linalg.solve(weighted @ basis.T + ridge, weighted @ change.T).T
    return coefficients


def agreement(residual: Array, tolerance: float) -> float:
    """Return the share of cells that agree, 0 to 1, from (K, N) residuals."""
    largest = np.abs(residual).max(axis=0) / tolerance
    return float((np.maximum(1 - largest * largest, 0) ** 2).mean())


def polynomial(shape: tuple[int, int], order: int) -> Array:
    """Return all products of powers of x and y up to an order, (M, N) float32; both in −1…1."""
    y, x = np.meshgrid(*(np.linspace(-1, 1, n, dtype=np.float32) for n in shape), indexing="ij")
    powers = [(i, j) for i in range(order + 1) for j in range(order + 1 - i)]
    return np.stack([(x**i * y**j).ravel() for i, j in sorted(powers, key=sum)])
