"""Surfaces of many touches: grids of balls, and height maps by rows."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.grid import GridLight, refine_grid
from tactile_core.algorithms.circles.press import PressImage
from tactile_core.algorithms.force.elastic_layer import THICKNESS_MM
from tactile_core.algorithms.heights.sphere import flat_equivalent
from tactile_core.algorithms.light.photometric import smooth_background
from tactile_core.calibration.light_range import undeformed_press, undeformed_sample
from tactile_core.calibration.press_search import press_image
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.result import Fold
from tactile_core.calibration.target_surface import HeightTarget
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.errors import InputError
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Bool, Float32, Frame, Reference


@dataclass(frozen=True, eq=False)
class MapBlock:
    """A band of rows of a height map, as a target surface.

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
        """The map's file name and the rows of the image."""
        top = self.target.first_row
        return f"{self.target.file} {top + self.first}:{top + self.last}"

    @property
    def frame(self) -> Frame:
        """The observation that shows the surface."""
        return self.target.frame

    @property
    def used(self) -> bool:
        """Whether the map holds any height in the band."""
        return bool(self.scored_area().any())

    @property
    def why(self) -> str:
        """Why it is not used; empty if it is."""
        return "" if self.used else "the map holds no heights here"

    @property
    def centre_px(self) -> tuple[float, float]:
        """Centre of the band, x and y."""
        middle = self.target.first_row + (self.first + self.last - 1) / 2
        return (self.frame.pixels.shape[1] - 1) / 2, middle

    @property
    def radius_px(self) -> float:
        """Radius of a circle of the same area."""
        return float(np.sqrt((self.last - self.first) * self.frame.pixels.shape[1] / np.pi))

    @property
    def ball_diameter_mm(self) -> None:
        """None: it is no ball."""

    def area(self) -> Bool:
        """(H, W) bool: the band."""
        return self._in_frame(self._band(0))

    def scored_area(self) -> Bool:
        """(H, W) bool: usable pixels, at a distance from the neighbouring bands."""
        return self._in_frame(self.target.usable & self._band(self.target.margin_px))

    def training(self) -> Press:
        """Usable pixels, thinned so that level areas do not outweigh steep ones.

        The probability of drawing a pixel is inversely proportional to the square root of the
        frequency of its slope. Without the root the steepest pixels, where the map is least
        accurate, would dominate.
        """
        rows, columns = np.nonzero(self.scored_area())
        gx, gy = (
            plane[rows - self.target.first_row, columns] for plane in self.target.smooth_slopes
        )
        slope_deg = np.degrees(np.arctan(np.hypot(gx, gy)))
        # [degrees] Bin width of the histogram of slopes by which pixels are thinned.
        bins = (slope_deg / 2.5).astype(int)
        weight = np.bincount(bins).astype(np.float64)[bins] ** -0.5
        count = min(5_000, len(rows))  # [count] Training pixels of a band, at most
        pick = np.random.default_rng(0).choice(
            len(rows), count, replace=False, p=weight / weight.sum()
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
        """(N,) measured minus true height over a mask, less a plane: the map's is arbitrary."""
        rows, columns = np.nonzero(mask)
        true = self.target.height_mm[rows - self.target.first_row, columns]
        error = height_mm[mask].astype(np.float64) - true
        plane = np.stack([np.ones(len(rows)), rows, columns], axis=1)
        return np.asarray(error - plane @ np.linalg.lstsq(plane, error, rcond=None)[0])

    def sphere(self, height_mm: Float32) -> None:
        """None: it is no ball."""

    def lighting(self, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
        """Slopes and changes of intensity of the fine structure of the relief."""
        top = self.target.first_row
        band = slice(top, top + len(self.target.height_mm))
        base = reference.pixels[band]
        # [share of full scale] Floor of the reference in the quotient of frame and reference.
        floor = np.float32(0.01 * self.frame.full_scale)
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
        No band does.
    """
    # [count] Bands into which the rows are divided, at most; each is held out once. Source: by
    # hand, equal to the folds of the cross-validation (``scoring.py``).
    # [px] Rows that a band has at least
    count = min(5, max(1, len(target.height_mm) // 20))
    edges = [round(len(target.height_mm) * i / count) for i in range(count + 1)]
    bands = [MapBlock(target, a, b) for a, b in pairwise(edges)]
    used = [band for band in bands if band.used]
    if not used:
        raise InputError(f"{target.file} holds no heights in these rows; choose others")
    return used


def _fine(planes: NDArray[np.float32]) -> NDArray[np.float32]:
    # [px] Standard deviation of the high-pass filter before light directions are estimated: a
    # reference that is made from the press has lost larger shapes.
    return np.asarray(planes - cv2.GaussianBlur(planes, (0, 0), 4.0), np.float32)


@dataclass(frozen=True, eq=False)
class PressedGrid:
    """Balls in one frame, with approximate circles from a target file.

    Attributes
    ----------
    file : str
    frame : Frame
        The frame as recorded.
    condition : Conditioning
    centres_px : (N, 2) float
        Approximate centres, x and y, from the target file.
    ball_radius_px : float
    dome_radius_px : float or None
        Radius of an undeformed domed gel; None for a flat one.
    thickness_mm : float
        Thickness of the gel.
    for_heights : bool
        As in :class:`~tactile_core.calibration.presses.FoundPress`.
    """

    file: str
    frame: Frame
    condition: Conditioning
    centres_px: np.ndarray
    ball_radius_px: float
    dome_radius_px: float | None = None
    thickness_mm: float = THICKNESS_MM
    for_heights: bool = False

    def refine_presses(self) -> list[FoundPress]:
        """Refine all circles jointly."""
        circles, _ = refine_grid(self._image(self._whole), self.centres_px, self._touching_px)
        return self._presses(self._whole, circles)

    def make_fold(self, held_out: Collection[int]) -> Fold[FoundPress] | None:
        """Refine the other circles in a copy of the frame without the held-out balls.

        Returns
        -------
        Fold, or None if no other ball can be used
        """
        others = [i for i in range(len(self.centres_px)) if i not in held_out]
        if not others:
            return None
        frame = self.condition.condition_without(self.frame, self._around(held_out))
        centres_px = self.centres_px[others]
        circles, light = refine_grid(self._image(frame), centres_px, self._touching_px)
        used = [press for press in self._presses(frame, circles) if press.used]
        if not used:
            return None
        reference = self.condition.undeformed
        undeformed = undeformed_press(used, reference)
        located = self._locate_presses(light, held_out)
        return Fold(used, reference, located.__getitem__, (undeformed,))

    def _locate_presses(self, light: GridLight, which: Collection[int]) -> dict[int, FoundPress]:
        numbers = sorted(which)
        centres_px = self.centres_px[numbers]
        circles = light.locate(self._image(self._whole), centres_px, self._touching_px)
        return dict(zip(numbers, self._presses(self._whole, circles), strict=True))

    def _presses(self, frame: Frame, circles: Sequence[Circle]) -> list[FoundPress]:
        return [
            FoundPress(
                self.file,
                frame,
                circle,
                self.ball_radius_px,
                in_grid=True,
                dome_radius_px=self.dome_radius_px,
                thickness_mm=self.thickness_mm,
                for_heights=self.for_heights,
            )
            for circle in circles
        ]

    @cached_property
    def _whole(self) -> Frame:
        """The complete frame, conditioned."""
        return self.condition(self.frame)

    @property
    def _touching_px(self) -> float:
        return flat_equivalent(self.ball_radius_px, self.dome_radius_px)

    def _image(self, frame: Frame) -> PressImage:
        return press_image(frame, self.condition.undeformed)

    def _around(self, which: Collection[int]) -> Bool:
        """(H, W) bool: discs around some balls, half as wide as the way to the next ball."""
        height, width = self.frame.pixels.shape[:2]
        x, y = np.arange(width), np.arange(height)[:, None]
        around = np.zeros((height, width), np.bool_)
        for i in which:
            apart = np.hypot(*(np.delete(self.centres_px, i, axis=0) - self.centres_px[i]).T)
            x0, y0 = self.centres_px[i]
            around |= np.hypot(x - x0, y - y0) < apart.min() / 2
        return around


@dataclass(frozen=True, eq=False)
class PressedMap:
    """A surface with a height map, in one frame.

    Attributes
    ----------
    bands : sequence of MapBlock
        Bands of the complete frame.
    frame : Frame
        The frame as recorded.
    condition : Conditioning
    reference_from_press : bool
        The reference is the large-scale light of the frame itself, not a recording.
    """

    bands: Sequence[MapBlock]
    frame: Frame
    condition: Conditioning
    reference_from_press: bool

    def sample_undeformed(self, condition: Conditioning) -> Press:
        """Training samples of the undeformed gel surface, from a conditioning's reference."""
        # [count] Pixels of the reference that join the training samples. They keep the model level
        # where the rows leave the image out. Source: chosen on a real grooved part (ADR 14);
        # thousands flatten narrow grooves.
        return undeformed_sample(self.frame, condition.undeformed, 300)

    def make_fold(self, held_out: Collection[int]) -> Fold[MapBlock] | None:
        """Return the other bands, in a copy of the frame without the held-out ones."""
        hidden = np.logical_or.reduce([self.bands[i].area() for i in held_out])
        condition = self._conditioning(hidden) if self.reference_from_press else self.condition
        target = replace(
            self.bands[0].target, frame=condition.condition_without(self.frame, hidden)
        )
        others = [
            replace(band, target=target) for i, band in enumerate(self.bands) if i not in held_out
        ]
        used = [band for band in others if band.used]
        if not used:
            return None
        undeformed = self.sample_undeformed(condition)
        return Fold(used, condition.undeformed, self.bands.__getitem__, (undeformed,))

    def _conditioning(self, hidden: Bool) -> Conditioning:
        """Return a conditioning whose reference is the light of the pixels that are not hidden."""
        shown = np.where(hidden[..., None], 0, self.frame.pixels)
        light = smooth_background(shown, hidden)
        return self.condition.with_reference(
            replace(self.condition.undeformed, pixels=light, marker_mask=None)
        )
