"""Height maps as calibration targets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.slopes.sampling import Sampling
from tactile_core.errors import InputError
from tactile_core.formats.tmd import Tmd, read_tmd
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Bool, Float32, Frame, Reference


class MeasuredSphere(NamedTuple):
    """A sphere that was fitted to a measured height map, compared with the ball.

    Attributes
    ----------
    radius_ratio : float
        Its radius over that of the ball; negative if the heights are a hollow.
    offset_px : float
        Distance of its centre from that of the circle that was found in the image.
    """

    radius_ratio: float
    offset_px: float


class TargetSurface(Protocol):
    """Part of a frame with ground truth: a pressed ball, or rows of a height map."""

    @property
    def file(self) -> str:
        """Name of its source, for reports."""

    @property
    def frame(self) -> Frame:
        """The observation that shows it."""

    @property
    def used(self) -> bool:
        """Whether it is good enough to fit on."""

    @property
    def why(self) -> str:
        """Why it is not used; empty if it is."""

    @property
    def centre_px(self) -> tuple[float, float]:
        """Its centre, x and y."""

    @property
    def radius_px(self) -> float:
        """Radius of the contact; for other shapes, of a circle of the same area."""

    @property
    def ball_diameter_mm(self) -> float | None:
        """Diameter of its ball; None for other shapes."""

    def area(self) -> Bool:
        """(H, W) bool: the pixels that it covers."""

    def training(self) -> Press:
        """Pixels to fit on."""

    def scored_area(self) -> Bool:
        """(H, W) bool: pixels that count in a score."""

    def true_gradients(self, mask: Bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and (N, 2) true slopes of the pixels of a mask."""

    def height_errors_mm(self, height_mm: Float32, mask: Bool) -> np.ndarray:
        """(N,) measured minus true height over a mask, up to what slopes leave undetermined."""

    def sphere(self, height_mm: Float32) -> MeasuredSphere | None:
        """Compare the ball with the sphere in a measured height map; None for other shapes."""

    def lighting(self, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) slopes and the (N, K) changes of intensity that they cause, to first order."""


S = TypeVar("S", bound=TargetSurface)


SUFFIX = ".tmd"  # Ending of a height map's file name


def is_height_map(target: Path | None) -> bool:
    """Return whether a target's file name is that of a height map."""
    return target is not None and target.suffix.lower() == SUFFIX


def parse_rows(text: str) -> slice:
    """Parse ``A:B``: rows A to B − 1, counted from 0.

    Either number may be left out, for the first and the last row.

    Raises
    ------
    InputError
        The text has another form, or selects no row.
    """
    first, colon, last = (part.strip() for part in text.partition(":"))
    if not colon or not all(part == "" or part.isdecimal() for part in (first, last)):
        raise InputError(
            f"--rows {text}: give A:B, the first row and the one after the last, counted from 0, "
            f"e.g. 0:257"
        )
    rows = slice(int(first or 0), int(last) if last else None)
    if rows.stop is not None and rows.stop <= rows.start:
        raise InputError(f"--rows {text} selects no row; B must be larger than A")
    return rows


@dataclass(frozen=True, eq=False)
class HeightTarget:
    """Rows of a height map at the resolution of the frame that shows the same surface.

    Attributes
    ----------
    file : str
        The map's file name, for reports.
    frame : Frame
    height_mm : (R, W) float32
        The selected rows; larger is nearer to the camera, as in
        :class:`~tactile_core.quantities.HeightMap`.
    measured : (R, W) bool
        Where the map holds a height.
    first_row : int
        Row of the frame at which the selected rows begin.
    blur_px : float
        Standard deviation of the smoothing that the fitted model applies to its images. The true
        slopes are smoothed by the same amount; otherwise fine grooves come out too deep.
    """

    file: str
    frame: Frame
    height_mm: Float32
    measured: Bool
    first_row: int
    blur_px: float = 0.0

    @classmethod
    def read(
        cls, path: Path, frame: Frame, *, rows: slice | None = None, blur_px: float = 0.0
    ) -> HeightTarget:
        """Read a TMD of the surface that the frame shows.

        Parameters
        ----------
        path : Path
        frame : Frame
        rows : slice, optional
            Rows of the map to use.
        blur_px : float

        Raises
        ------
        InputError
            The map's size is no integer multiple of the frame's, its scale differs, or the rows
            are out of range or too few.
        """
        tmd = read_tmd(path)
        height, width = frame.pixels.shape[:2]
        factor = _factor(tmd, path, frame)
        part = _part(rows, len(tmd.height_mm), path)
        first, last = -(-part.start // factor), part.stop // factor
        measured = np.isfinite(tmd.height_mm)
        level = np.median(tmd.height_mm[measured])
        filled = np.where(measured, tmd.height_mm, level).astype(np.float32)
        if factor > 1:
            size = width, height
            filled = np.asarray(cv2.resize(filled, size, interpolation=cv2.INTER_AREA), np.float32)
            share = cv2.resize(measured.astype(np.float32), size, interpolation=cv2.INTER_AREA)
            # [share] A pixel of the frame counts as measured if at least this share of the map's
            # pixels in it hold heights. Source: mathematics; 1 less a margin for float32 averages.
            measured = np.asarray(share) > 0.999
        made = cls(path.name, frame, filled[first:last], measured[first:last], first, blur_px)
        if last - first <= 2 * made.margin_px:
            raise InputError(
                f"{path}: {last - first} rows of the image are too few to calibrate on; give more "
                f"than {2 * made.margin_px * factor} rows of the map"
            )
        return made

    @property
    def margin_px(self) -> int:
        """Width in px of the unused margin at borders, where smoothing mixes in other pixels."""
        # [standard deviations of the smoothing] Distance from a border within which smoothed slopes
        # are not used. Source: mathematics; two standard deviations hold 95 % of a Gaussian.
        return int(np.ceil(2.0 * self.blur_px)) + 1

    @cached_property
    def slopes(self) -> tuple[Float32, Float32]:
        """∂z/∂x and ∂z/∂y of the rows, two (R, W) planes, without the map's arbitrary tilt."""
        return _slopes(self.height_mm, self.frame.mm_per_px)

    @cached_property
    def smooth_slopes(self) -> tuple[Float32, Float32]:
        """The slopes, smoothed like the images that the model measures."""
        return _slopes(self._smoothed_mm, self.frame.mm_per_px)

    @cached_property
    def smooth_relief_mm(self) -> Float32:
        """(R, W) heights, smoothed like the images, without the map's arbitrary tilt and level."""
        height_mm = self._smoothed_mm.astype(np.float64)
        fall_y, fall_x = (np.median(g) for g in np.gradient(height_mm))
        height_mm -= fall_x * np.arange(height_mm.shape[1])
        height_mm -= fall_y * np.arange(height_mm.shape[0])[:, None]
        return np.asarray(height_mm - np.median(height_mm[self.usable]), np.float32)

    @cached_property
    def _smoothed_mm(self) -> Float32:
        smoothing = Sampling.at_every_pixel(self.height_mm.shape, None, self.blur_px)
        return smoothing.smooth_image(self.height_mm[..., None], None)[..., 0]

    @cached_property
    def usable(self) -> Bool:
        """(R, W) bool: pixels away from borders, holes of the map and markers."""
        usable = self.measured.copy()
        if self.frame.marker_mask is not None:
            usable &= ~self.frame.marker_mask[self.first_row : self.first_row + len(usable)]
        element = np.ones((2 * self.margin_px + 1,) * 2, np.uint8)
        inside = cv2.erode(
            usable.view(np.uint8), element, borderType=cv2.BORDER_CONSTANT, borderValue=(0.0,)
        )
        return np.asarray(inside, np.bool_)


def _factor(tmd: Tmd, path: Path, frame: Frame) -> int:
    """Return how many pixels of the map one pixel of the frame is wide."""
    (rows, columns), (height, width) = tmd.height_mm.shape, frame.pixels.shape[:2]
    factor: int = max(1, round(rows / height))
    if (rows, columns) != (factor * height, factor * width):
        raise InputError(
            f"{path} is {columns} × {rows} and the image {width} × {height}; give the height map "
            f"of this image, at the same size or larger by a whole factor"
        )
    if not np.isfinite(tmd.height_mm).any():
        raise InputError(f"{path} holds no heights; export it again")
    heights = tmd.height_mm[np.isfinite(tmd.height_mm)].astype(np.float64)
    if np.ptp(heights) > tmd.mm_per_px * (rows + columns):
        raise InputError(
            f"{path} holds heights that differ by {np.ptp(heights):.4g} mm, far higher than the "
            f"map is wide; export it again, in mm"
        )
    scale = tmd.mm_per_px * factor
    # [ratio] Scales of the map and of the profile may differ by this share. Source: the tolerance
    # of all scales, as for bundles (``bundles/bundle.py``).
    if abs(scale / frame.mm_per_px - 1) > 0.01:
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
    """Return central differences minus their median: most of the surface counts as level."""
    gy, gx = np.gradient(height_mm.astype(np.float64), mm_per_px)
    return (
        np.asarray(gx - np.median(gx), np.float32),
        np.asarray(gy - np.median(gy), np.float32),
    )
