"""Images on coarser grids, and the slope of an image."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Float32

MOST_CHANNELS = 4  # OpenCV shrinks at most this many channels at once, unless by an integer factor


def shrink_image(image: Array, size_px: tuple[int, int], *, halvings: int = 8) -> Array:
    """Shrink an image; each new pixel is the mean over the area that it covers.

    Parameters
    ----------
    image : (H, W) or (H, W, K) uint8, uint16, float32 or float64
        Any number of channels.
    size_px : (width, height)
        Size of the result, not larger than the image.
    halvings : int
        How often the image may be halved first, as long as that divides it exactly. Halving is
        vectorised, averaging by other factors is not. Integers are rounded each time.

    Returns
    -------
    (height, width) or (height, width, K), same dtype
    """
    channels, (rows, columns) = image.shape[2:], image.shape[:2]
    across, down = 2 * size_px[0], 2 * size_px[1]
    while halvings and not (rows % down or columns % across):
        halvings, rows, columns = halvings - 1, rows // 2, columns // 2
        image = np.asarray(cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA))
    if (columns, rows) != size_px:
        wide = image.ndim == 3 and channels[0] > MOST_CHANNELS
        planes = cv2.split(image) if wide else [image]
        small = [cv2.resize(plane, size_px, interpolation=cv2.INTER_AREA) for plane in planes]
        image = np.dstack(small) if wide else np.asarray(small[0])
    return image.reshape(size_px[1], size_px[0], *channels)


# Factors that repeat a byte in a word of so many bytes.
_WORDS: dict[int, Any] = {
    2: np.uint16(0x0101),
    4: np.uint32(0x01010101),
    8: np.uint64(0x0101010101010101),
}


def repeat_pixels(image: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Enlarge an (h, w) uint8 image to an (H, W) shape by nearest-neighbour interpolation."""
    if image.shape == shape:
        return image
    times = shape[0] // image.shape[0]
    if (image.shape[0] * times, image.shape[1] * times) != shape:
        nearest = cv2.resize(image, shape[::-1], interpolation=cv2.INTER_NEAREST)
        return np.asarray(nearest, np.uint8)
    # to 640 × 480 in 10 instead of 110 µs: equal bytes of a word, or channels, are neighbours
    if times in _WORDS:
        wide = (image * _WORDS[times]).view(np.uint8)
    else:
        wide = np.asarray(cv2.merge([image] * times), np.uint8).reshape(len(image), -1)
    return np.repeat(wide, times, axis=0)


def enlarge_cells(cells: Array, shape: tuple[int, ...]) -> Array:
    """Enlarge an (h, w, …) grid of cells that tile an image to (H, W, …), interpolated linearly.

    A grid of that size is returned unchanged.
    """
    if cells.shape[:2] == tuple(shape[:2]):
        return cells
    large = cv2.resize(cells, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    return np.asarray(large).reshape(*shape[:2], *cells.shape[2:])


def interpolate_cells(cells: Array, step_px: int, shape: tuple[int, int]) -> Array:
    """Interpolate (h, w) cells of ``step_px`` pixels to an (H, W) image, in a new array.

    Parameters
    ----------
    cells : (h, w)
        Values at the centres of cells from the first row and column on. The last cells may reach
        beyond the image.
    step_px : int
        Side of a cell.
    shape : (H, W)
        Of the image.
    """
    size = cells.shape[1] * step_px, cells.shape[0] * step_px
    whole = np.asarray(cv2.resize(cells, size, interpolation=cv2.INTER_LINEAR))
    return np.ascontiguousarray(whole[: shape[0], : shape[1]])


# Lagrange's cubic at a quarter of the way from the second to the third of four values.
_WEIGHTS = np.array([-7, 105, 35, -5], np.float32) / 128


def refine_cells(cells: Float32) -> Float32:
    """Interpolate (h, w) cells to the (2 h, 2 w) cells of half their side that they consist of.

    A cubic through the four nearest cells along each axis keeps the peak of a small object, which
    linear interpolation cuts off. At the border the last cell is repeated.
    """
    return np.ascontiguousarray(_along_rows(_along_rows(cells).T).T)


def _along_rows(cells: Float32) -> Float32:
    """Interpolate to twice the rows."""
    count = len(cells)
    padded = np.pad(cells, ((2, 2), (0, 0)), mode="edge")
    near = [padded[2 + k : 2 + k + count] for k in (-2, -1, 0, 1, 2)]
    fine = np.empty((2 * count, cells.shape[1]), np.float32)
    fine[0::2] = sum(w * part for w, part in zip(_WEIGHTS, near[3::-1], strict=True))
    fine[1::2] = sum(w * part for w, part in zip(_WEIGHTS, near[1:], strict=True))
    return fine


def coarse_size(rows: int, columns: int, points: int) -> tuple[int, int]:
    """Width and height of a coarse grid of about ``points`` points.

    A step that divides both sides is preferred: averaging over whole pixels is much faster.
    """
    ideal = max(1.0, (rows * columns / points) ** 0.5)
    steps = range(max(1, round(0.6 * ideal)), round(1.6 * ideal) + 1)  # as many points within 2.6
    step = min(steps, key=lambda s: (rows % s + columns % s > 0, abs(s - ideal)))
    return max(1, columns // step), max(1, rows // step)


def gradient(
    image: NDArray[Any], spacing: float = 1.0, *, smooth: bool = False
) -> tuple[Float32, Float32]:
    """Partial derivatives of each channel.

    Parameters
    ----------
    image : (H, W) or (H, W, K) float32
    spacing : float
        Distance of neighbouring pixels.
    smooth : bool
        Average three neighbouring differences with weights 1 : 2 : 1 (Sobel operator).

    Returns
    -------
    along, down : float32, same shape
        Derivative to the right and downwards, per unit of ``spacing``.
    """
    size, weight = (3, 0.125) if smooth else (1, 0.5)
    image = np.asarray(image, np.float32)
    scale = weight / spacing
    along, down = (
        np.asarray(cv2.Sobel(image, cv2.CV_32F, *order, ksize=size, scale=scale), np.float32)
        for order in ((1, 0), (0, 1))
    )
    return along.reshape(image.shape), down.reshape(image.shape)


def steepness(image: Float32, spacing: float = 1.0, *, smooth: bool = False) -> Float32:
    """Magnitude of the :func:`gradient` of an (H, W) image, (H, W)."""
    return np.asarray(cv2.magnitude(*gradient(image, spacing, smooth=smooth)), np.float32)
