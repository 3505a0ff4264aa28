"""Millimetres per pixel: from a known length, a grid of balls, printed markers or what a scan says.

A ball that is pressed does not give it. How wide the contact is depends on how deep the ball was
pressed, and how much a slope changes the light is what calibration learns by means of the scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.acquisition.geometry import ImageGeometry, Size
from tactile_core.errors import InputError
from tactile_core.formats.target import read_target
from tactile_core.interfaces.image import ImageSection
from tactile_core.profiles.model import Profile
from tactile_core.scaffold.finding import Finding
from tactile_core.scaffold.known_size import KnownSize
from tactile_core.scaffold.markers import FoundMarkers

AGREEMENT = 0.03
"""Scales told by different things may differ so much; markers are printed no better."""


@dataclass(frozen=True)
class Scale:
    """Scale of the resulting image.

    Attributes
    ----------
    mm_per_px : float
    told_by : str
        What tells it, in words that follow "by".
    """

    mm_per_px: float
    told_by: str

    @classmethod
    def given(cls, mm_per_px: float) -> Scale:
        """Take the user's word, of the resulting image.

        Raises
        ------
        InputError
            It is not positive.
        """
        if not 0 < mm_per_px < np.inf:
            raise InputError(f"--mm-per-px {mm_per_px:g}: a pixel must be larger than nothing")
        return cls(mm_per_px, "--mm-per-px")

    @classmethod
    def of_known_size(cls, known: KnownSize, section: ImageSection, camera: Size) -> Scale:
        """Measure a length or a rectangle that is marked in the camera's picture."""
        if known.is_rectangle:
            width_mm, height_mm = known.size_mm
            words = f"a rectangle of {width_mm:g} × {height_mm:g} mm"
            return cls(width_mm / section.width_px, words)
        ends = ImageGeometry(section).map_points(known.points_px, camera)
        length_px = float(np.hypot(*(ends[1] - ends[0])))
        (length_mm,) = known.size_mm
        return cls(length_mm / length_px, f"{length_mm:g} mm that are {length_px:.1f} px long")

    @classmethod
    def of_target(cls, path: Path, section: ImageSection, camera: Size) -> Scale:
        """Measure the pitch of a grid of balls.

        Targets are often drawn on the full picture and used with a binned one: the circles are
        taken for a whole number of times larger, as many as make them lie within the picture.

        Raises
        ------
        InputError
            The file tells no pitch.
        """
        grid = read_target(path)
        if grid.mm_per_px is None:
            raise InputError(
                f"{path} tells no scale: it needs 'pitch' in mm and circles with grid places gx, gy"
            )
        finer = int(max(1.0, np.ceil((grid.centres_px.max(axis=0) / camera).max())))
        camera_mm = grid.mm_per_px * finer
        words = f"the pitch of the balls of {path.name}"
        if finer > 1:
            words += f", drawn on a picture {finer} times as large"
        return cls(_resulting(camera_mm, section, camera), words)

    @classmethod
    def of_markers(cls, markers: FoundMarkers, pitch_mm: float) -> Scale:
        """Measure how far apart the printed markers are."""
        words = f"markers every {pitch_mm:g} mm that are {markers.pitch_px:.1f} px apart"
        return cls(pitch_mm / markers.pitch_px, words)

    @classmethod
    def of_scan(
        cls, camera_mm_per_px: float, name: str, section: ImageSection, camera: Size
    ) -> Scale:
        """Take what a scan says of the camera's pixels."""
        return cls(_resulting(camera_mm_per_px, section, camera), f"mmperpixel of {name}")


def agreed(scales: list[Scale]) -> Scale | None:
    """Return the first scale, if the others agree with it; None where there is none.

    Raises
    ------
    InputError
        Two contradict each other.
    """
    for other in scales[1:]:
        ratio = other.mm_per_px / scales[0].mm_per_px
        if abs(ratio - 1) > AGREEMENT:
            raise InputError(
                f"{scales[0].told_by} gives {scales[0].mm_per_px:.4g} mm per pixel and "
                f"{other.told_by} {other.mm_per_px:.4g}; give only the one that is right"
            )
    return scales[0] if scales else None


def scale_finding(told: Scale | None, parent: Profile, width_px: int) -> Finding:
    """Put the scale into words; the parent's view stands in where nothing tells it."""
    if told is not None:
        comment = f"Millimetres of gel that one pixel shows, by {told.told_by}."
        return Finding("image", comment, {"mm_per_px": rounded(told.mm_per_px)})
    view_mm = parent.image.mm_per_px * parent.image.width_px
    guess = rounded(view_mm / width_px)
    comment = (
        f"NOT MEASURED: {guess:g} is right if the image is {view_mm:.3g} mm wide, as "
        f"{parent.name}'s is. All heights and areas hang on it: measure it with something of known "
        f"size on the gel (--known-mm and --known-px, or --marker-pitch-mm)."
    )
    return Finding("image", comment, {"mm_per_px": guess}, noted=True)


def rounded(mm_per_px: float) -> float:
    """Five digits: no length is measured better."""
    return float(f"{mm_per_px:.5g}")


def _resulting(camera_mm_per_px: float, section: ImageSection, camera: Size) -> float:
    unit = section.model_copy(update={"mm_per_px": 1.0})
    return camera_mm_per_px / ImageGeometry(unit).camera_mm_per_px(camera)
