"""The coarse plane of slip: fields of displacement at one point in each block of pixels."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Complex64, Float32, Intp, as_complex, nodes

Scalar = TypeVar("Scalar", bound=np.generic)


def stride_of(width_px: int) -> int:
    """Return the distance of grid points in pixels."""
    return max(1, width_px // 80)  # [columns] markers a millimetre apart resolve no more


def blocks(image_shape: tuple[int, int], stride: int) -> tuple[int, int]:
    """Return the rows and columns of the grid of an image."""
    rows, columns = (len(range(stride // 2, side, stride)) for side in image_shape)
    return rows, columns


def coarse(cells: Float32, image_shape: tuple[int, ...], stride: int) -> Float32:
    """Interpolate a field of cells (rows, columns, …) that tile an image in each block of pixels.

    Returns
    -------
    (h, w, …) float32
        At the pixels that :func:`pick_pixels` samples.
    """
    per_px = tuple(n / side for n, side in zip(cells.shape[:2], image_shape[:2], strict=True))
    x, y = _meshed_places(per_px, image_shape[:2], stride)
    how, border = cv2.INTER_LINEAR, cv2.BORDER_REPLICATE
    # one by one, because OpenCV rounds the places of two channels to 1/32 of a cell
    planes = [cv2.remap(each, x, y, how, borderMode=border) for each in cv2.split(cells)]
    return np.asarray(cv2.merge(planes), np.float32)


def coarse_field(cells: Float32, image_shape: tuple[int, ...], stride: int) -> Complex64:
    """Do the same with displacements (rows, columns, 2), x + iy, (h, w)."""
    return as_complex(coarse(cells, image_shape, stride))


def sample_cells(
    cells: Float32, step_px: int, image_shape: tuple[int, int], stride: int
) -> Float32:
    """Interpolate (rows, columns) cells of ``step_px`` pixels in each block of pixels.

    Parameters
    ----------
    cells : (rows, columns) float32
        From the first row and column of the image on; the last may reach beyond it.
    step_px : int
        Side of a cell; 1 for an image.
    image_shape : (H, W)
    stride : int

    Returns
    -------
    (h, w) float32
        At the pixels that :func:`pick_pixels` samples.
    """
    if step_px == 1:
        return pick_pixels(cells, stride)
    x, y = _meshed_places((1 / step_px, 1 / step_px), image_shape, stride)
    how, border = cv2.INTER_LINEAR, cv2.BORDER_REPLICATE
    return np.asarray(cv2.remap(cells, x, y, how, borderMode=border), np.float32)


@lru_cache(maxsize=8)
def _places(
    per_px: tuple[float, ...], image_shape: tuple[int, ...], stride: int
) -> tuple[Float32, Float32]:
    """Columns (w,) and rows (h,) of the grid points in cells, of which so many are in a pixel."""
    rows, columns = (
        np.asarray((np.arange(stride // 2, side, stride) + 0.5) * share - 0.5, np.float32)
        for share, side in zip(per_px, image_shape, strict=True)
    )
    return columns, rows


@lru_cache(maxsize=8)
def _meshed_places(
    per_px: tuple[float, ...], image_shape: tuple[int, ...], stride: int
) -> tuple[Float32, Float32]:
    """Column and row (h, w) of each grid point."""
    x, y = np.meshgrid(*_places(per_px, image_shape, stride))
    return x, y


def pick_pixels(image: NDArray[Scalar], stride: int) -> NDArray[Scalar]:
    """Sample an image (H, W) in the middle of each block of pixels, (h, w)."""
    first = stride // 2
    return np.ascontiguousarray(image[first::stride, first::stride])


Window = tuple[slice, slice]  # Rows and columns of a part of a field


def displacement_since(
    now: Complex64, before: Complex64, spacing_mm: float, *, window: Window | None = None
) -> Complex64:
    """Return the displacement of the surface since an earlier field, mm.

    Parameters
    ----------
    now, before : (h, w) complex64
        Each refers to the surface points that were at the grid points at its time.
    spacing_mm : float
        Distance between neighbouring grid points.
    window : (slice, slice), optional
        Where it is wanted. Default: everywhere.

    Returns
    -------
    (h, w) complex64, or the window of it
        Refers to the surface points that are at the grid points now.
    """
    at = _nodes(now.shape)
    there = (now, before) if window is None else (now[window], before[window])
    return _displacement_at(*there, before, at if window is None else at[window], spacing_mm)


def since_at(now: Complex64, before: Complex64, spacing_mm: float, chosen: Intp) -> Complex64:
    """Return the same at points (n,) with these flat indices."""
    at = _nodes(now.shape).reshape(1, -1, 2).take(chosen, axis=1)
    at_now, was_there = (each.reshape(1, -1).take(chosen, axis=1) for each in (now, before))
    return np.asarray(_displacement_at(at_now, was_there, before, at, spacing_mm)[0])


def _displacement_at(
    now: Complex64, was_there: Complex64, before: Complex64, at: Float32, spacing_mm: float
) -> Complex64:
    """Displacement of points ``at`` (a, b, 2), where the fields are ``now`` and ``was_there``."""
    moved, per_point, field = now - was_there, np.float32(1 / spacing_mm), parts(before)
    # the same surface point was elsewhere at the time of the earlier field
    for _ in range(2):  # displacements vary slowly, so that two converge
        came_from = at - parts(moved) * per_point
        was = cv2.remap(
            field,
            came_from,
            np.empty(0),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        moved = now - as_complex(np.asarray(was, np.float32))
    return moved


@lru_cache(maxsize=4)
def positions_mm(shape: tuple[int, ...], spacing_mm: float) -> Complex64:
    """Return the positions (h, w) of the grid points relative to the centre of the field, mm."""
    middle = complex(shape[1] - 1, shape[0] - 1) / 2
    positions = np.asarray((as_complex(_nodes(shape)) - middle) * spacing_mm)
    positions.flags.writeable = False
    return positions


@lru_cache(maxsize=4)
def _nodes(shape: tuple[int, ...]) -> Float32:
    """(h, w, 2) column and row of each grid point."""
    return nodes(shape)


def parts(field: Complex64) -> Float32:
    """View complex numbers (…) as x and y, (…, 2)."""
    return field.view(np.float32).reshape(*field.shape, 2)
