"""Millimetres per pixel, from a known length, a grid of balls, printed markers or a scan.

A pressed ball does not determine the scale: the width of the contact depends on the indentation,
and the relation of shading and slope is what a calibration learns with the help of the scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactile_core.acquisition.geometry import ImageGeometry, Size
from tactile_core.errors import InputError
from tactile_core.formats.target import read_target
from tactile_core.interfaces.image import ImageSection
from tactile_core.profiles.model import Profile
from tactile_core.scaffold.finding import Finding
from tactile_core.scaffold.known_size import KnownSize
from tactile_core.scaffold.markers import FoundMarkers


class ScaleParameters(NamedTuple):
    """Parameters of the comparison of scales. Nothing sets them from outside: it catches mistakes.

    Attributes
    ----------
    tolerance : float, ratio
        Scales from different sources may differ by this share.
        Source: chosen by hand as the accuracy of printed markers
        (ADR 17).
    """

    tolerance: float = 0.03


SCALE = ScaleParameters()
"""The values in use."""


@dataclass(frozen=True)
class Scale:
    """Scale of the resulting image.

    Attributes
    ----------
    mm_per_px : float
    source : str
        Origin of the scale, for messages.
    """

    mm_per_px: float
    source: str

    @classmethod
    def given(cls, mm_per_px: float) -> Scale:
        """Return the scale that the user gives for the resulting image.

        Raises
        ------
        InputError
            It is not positive.
        """
        if not 0 < mm_per_px < np.inf:
            raise InputError(f"--mm-per-px {mm_per_px:g}: the scale must be positive")
        return cls(mm_per_px, "--mm-per-px")

    @classmethod
    def of_known_size(cls, known: KnownSize, section: ImageSection, camera: Size) -> Scale:
        """Measure a length or a rectangle with known points in the camera's image."""
        if known.is_rectangle:
            width_mm, height_mm = known.size_mm
            return cls(
                width_mm / section.width_px, f"a rectangle of {width_mm:g} × {height_mm:g} mm"
            )
        ends = ImageGeometry(section).map_points(known.points_px, camera)
        length_px = float(np.hypot(*(ends[1] - ends[0])))
        (length_mm,) = known.size_mm
        return cls(length_mm / length_px, f"a length of {length_mm:g} mm = {length_px:.1f} px")

    @classmethod
    def of_target(cls, path: Path, section: ImageSection, camera: Size) -> Scale:
        """Measure the pitch of a grid of balls.

        Targets are often drawn on the full image and used with a binned one. If circles are outside
        the image, the target is therefore downscaled by the smallest whole factor that brings them
        inside.

        Raises
        ------
        InputError
            The file has no pitch.
        """
        grid = read_target(path)
        if grid.mm_per_px is None:
            raise InputError(
                f"{path} has no scale: it needs 'pitch' in mm and circles with grid indices gx, gy"
            )
        factor = int(max(1.0, np.ceil((grid.centres_px.max(axis=0) / camera).max())))
        camera_mm = grid.mm_per_px * factor
        source = f"the pitch of the balls of {path.name}"
        if factor > 1:
            source += f", drawn on an image {factor} times as large"
        return cls(_resulting(camera_mm, section, camera), source)

    @classmethod
    def of_markers(cls, markers: FoundMarkers, pitch_mm: float) -> Scale:
        """Measure the pitch of the printed markers."""
        source = f"a marker pitch of {pitch_mm:g} mm = {markers.pitch_px:.1f} px"
        return cls(pitch_mm / markers.pitch_px, source)

    @classmethod
    def of_scan(
        cls, camera_mm_per_px: float, name: str, section: ImageSection, camera: Size
    ) -> Scale:
        """Return the scale of a scan, converted from the camera's pixels."""
        return cls(_resulting(camera_mm_per_px, section, camera), f"mmperpixel of {name}")


def agreed(scales: list[Scale]) -> Scale | None:
    """Return the first scale if the others agree with it; None for an empty list.

    Raises
    ------
    InputError
        Two scales contradict each other.
    """
    for other in scales[1:]:
        ratio = other.mm_per_px / scales[0].mm_per_px
        if abs(ratio - 1) > SCALE.tolerance:
            raise InputError(
                f"{scales[0].source} gives {scales[0].mm_per_px:.4g} mm per pixel and "
                f"{other.source} {other.mm_per_px:.4g}; give only the one that is right"
            )
    return scales[0] if scales else None


def scale_finding(scale: Scale | None, parent: Profile, width_px: int) -> Finding:
    """Return the finding for the profile; without a scale it assumes the parent's field of view."""
    if scale is not None:
        comment = f"Millimetres per pixel on the gel, from {scale.source}."
        return Finding("image", comment, {"mm_per_px": rounded(scale.mm_per_px)})
    view_mm = parent.image.mm_per_px * parent.image.width_px
    guess = rounded(view_mm / width_px)
    comment = (
        f"NOT MEASURED: {guess:g} is right if the image is {view_mm:.3g} mm wide like "
        f"{parent.name}'s. All heights and areas depend on it: measure it with an object of known "
        f"size on the gel (--known-mm and --known-px, or --marker-pitch-mm)."
    )
    return Finding("image", comment, {"mm_per_px": guess}, noted=True)


def rounded(mm_per_px: float) -> float:
    """Round to five significant digits, more than any length is measured to."""
    return float(f"{mm_per_px:.5g}")


def _resulting(camera_mm_per_px: float, section: ImageSection, camera: Size) -> float:
    unit = section.model_copy(update={"mm_per_px": 1.0})
    return camera_mm_per_px / ImageGeometry(unit).camera_mm_per_px(camera)
