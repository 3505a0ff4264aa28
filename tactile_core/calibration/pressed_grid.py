"""Surfaces of many touches: grids of balls, and height maps."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tactile_core.algorithms.circles import Circle, GridLight, PressImage, refine_grid
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.algorithms.photometric import smooth_background
from tactile_core.algorithms.sphere import flat_equivalent
from tactile_core.calibration.light_range import undeformed_press, undeformed_sample
from tactile_core.calibration.map_rows import MAP_ROWS, MapBlock
from tactile_core.calibration.press_search import press_image
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.result import Fold
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Bool, Frame


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
        return undeformed_sample(self.frame, condition.undeformed, MAP_ROWS.undeformed_pixels)

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
