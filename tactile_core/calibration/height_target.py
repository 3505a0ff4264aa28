"""A known height map as calibration target, at the size of the frame that shows the surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.photometric import Smoothing
from tactile_core.errors import InputError
from tactile_core.formats.tmd import Tmd, read_tmd
from tactile_core.quantities import Bool, Float32, Frame

SUFFIX = ".tmd"
SCALE_TOLERANCE = 0.01


def is_height_map(target: Path | None) -> bool:
    """Whether a target is a height map, by its name."""
    return target is not None and target.suffix.lower() == SUFFIX


def parse_rows(text: str) -> slice:
    """Read ``A:B``, rows from A up to and without B, counted from 0.

    Either may be left out, for the first and the last.

    Raises
    ------
    InputError
        It is something else, or holds no row.
    """
    first, colon, last = (part.strip() for part in text.partition(":"))
    if not colon or not all(part == "" or part.isdecimal() for part in (first, last)):
        raise InputError(
            f"--rows {text}: give A:B, the first row and the one after the last, counted from 0, "
            f"e.g. 0:257"
        )
    rows = slice(int(first or 0), int(last) if last else None)
    if rows.stop is not None and rows.stop <= rows.start:
        raise InputError(f"--rows {text} holds no row; B must be larger than A")
    return rows


@dataclass(frozen=True, eq=False)
class HeightTarget:
    """Rows of a height map, at the size of the frame that shows the same surface.

    Attributes
    ----------
    file : str
        The map's name, for people.
    frame : Frame
    height_mm : (R, W) float32
        The rows that may be used, and no others; larger is nearer to the camera, as in
        :class:`~tactile_core.quantities.HeightMap`.
    known : (R, W) bool
        Where the map holds a number.
    first_row : int
        The frame's row of the first of them.
    blur_px : float
        How much the model that is fitted smooths its images: a slope must be as smooth as the
        light that tells it, or fine grooves come out too deep.
    """

    file: str
    frame: Frame
    height_mm: Float32
    known: Bool
    first_row: int
    blur_px: float = 0.0

    @classmethod
    def read(
        cls, path: Path, frame: Frame, *, rows: slice | None = None, blur_px: float = 0.0
    ) -> HeightTarget:
        """Read a TMD of the very surface that the frame shows.

        Parameters
        ----------
        path : Path
        frame : Frame
        rows : slice, optional
            Rows of the map that may be used.
        blur_px : float

        Raises
        ------
        InputError
            The map's size is neither the frame's nor a whole number of times it, its scale is
            another, or the rows lie outside it or are too few.
        """
        tmd = read_tmd(path)
        height, width = frame.pixels.shape[:2]
        factor = _factor(tmd, path, frame)
        part = _part(rows, len(tmd.height_mm), path)
        first, last = -(-part.start // factor), part.stop // factor
        known = np.isfinite(tmd.height_mm)
        filled = np.where(known, tmd.height_mm, np.median(tmd.height_mm[known])).astype(np.float32)
        if factor > 1:
            size = width, height
            filled = np.asarray(cv2.resize(filled, size, interpolation=cv2.INTER_AREA), np.float32)
            share = cv2.resize(known.astype(np.float32), size, interpolation=cv2.INTER_AREA)
            known = np.asarray(share) > 0.999
        made = cls(path.name, frame, filled[first:last], known[first:last], first, blur_px)
        if last - first <= 2 * made.margin_px:
            raise InputError(
                f"{path}: {last - first} rows of the image are too few to calibrate on; give more "
                f"than {2 * made.margin_px * factor} rows of the map"
            )
        return made

    @property
    def margin_px(self) -> int:
        """How near to a border slopes are not trusted: smoothing mixes in what lies beyond."""
        return int(np.ceil(2 * self.blur_px)) + 1

    @cached_property
    def slopes(self) -> tuple[Float32, Float32]:
        """∂z/∂x and ∂z/∂y of the rows, two (R, W) planes; the free tilt of the map is removed."""
        return _slopes(self.height_mm, self.frame.mm_per_px)

    @cached_property
    def smooth_slopes(self) -> tuple[Float32, Float32]:
        """The same, as smooth as the images that a model sees."""
        return _slopes(self._smoothed_mm, self.frame.mm_per_px)

    @cached_property
    def smooth_relief_mm(self) -> Float32:
        """(R, W) heights as smooth as those images, less the map's free tilt and level."""
        height_mm = self._smoothed_mm.astype(np.float64)
        fall_y, fall_x = (np.median(g) for g in np.gradient(height_mm))
        height_mm -= fall_x * np.arange(height_mm.shape[1])
        height_mm -= fall_y * np.arange(height_mm.shape[0])[:, None]
        return np.asarray(height_mm - np.median(height_mm[self.usable]), np.float32)

    @cached_property
    def _smoothed_mm(self) -> Float32:
        smoothing = Smoothing.of(None, self.blur_px)
        return np.asarray(smoothing.apply(self.height_mm[..., None], None)[..., 0], np.float32)

    @cached_property
    def usable(self) -> Bool:
        """(R, W) bool: far enough from a border, a hole of the map, and a marker."""
        usable = self.known.copy()
        if self.frame.marker_mask is not None:
            usable &= ~self.frame.marker_mask[self.first_row : self.first_row + len(usable)]
        element = np.ones((2 * self.margin_px + 1,) * 2, np.uint8)
        inside = cv2.erode(
            usable.view(np.uint8), element, borderType=cv2.BORDER_CONSTANT, borderValue=(0.0,)
        )
        return np.asarray(inside, np.bool_)


def _factor(tmd: Tmd, path: Path, frame: Frame) -> int:
    """How many pixels of the map lie side by side in one of the frame."""
    (rows, columns), (height, width) = tmd.height_mm.shape, frame.pixels.shape[:2]
    factor: int = max(1, round(rows / height))
    if (rows, columns) != (factor * height, factor * width):
        raise InputError(
            f"{path} is {columns} × {rows} and the image {width} × {height}; give the height map "
            f"of this very image, at its size or a whole number of times larger"
        )
    if not np.isfinite(tmd.height_mm).any():
        raise InputError(f"{path} holds no heights; export it again")
    known = tmd.height_mm[np.isfinite(tmd.height_mm)].astype(np.float64)
    if np.ptp(known) > tmd.mm_per_px * (rows + columns):
        raise InputError(
            f"{path} holds heights that differ by {np.ptp(known):.4g} mm, far higher than the map "
            f"is wide; export it again, in mm"
        )
    scale = tmd.mm_per_px * factor
    if abs(scale / frame.mm_per_px - 1) > SCALE_TOLERANCE:
        raise InputError(
            f"{path} has {scale:.5g} mm per pixel of the image and the profile "
            f"{frame.mm_per_px:.5g}; correct 'image.mm_per_px', or give the map of this image"
        )
    return factor


def _part(rows: slice | None, count: int, path: Path) -> slice:
    if rows is None:
        return slice(0, count)
    start, stop = rows.start or 0, count if rows.stop is None else rows.stop
    if not 0 <= start < stop <= count:
        raise InputError(f"--rows {start}:{stop}: {path} has the rows 0:{count}; choose among them")
    return slice(start, stop)


def _slopes(height_mm: NDArray[np.float32], mm_per_px: float) -> tuple[Float32, Float32]:
    """Central differences less the commonest tilt: most of the land counts as level."""
    gy, gx = np.gradient(height_mm.astype(np.float64), mm_per_px)
    return (
        np.asarray(gx - np.median(gx), np.float32),
        np.asarray(gy - np.median(gy), np.float32),
    )
