"""Finds presses in recordings, and which size of ball they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tactile_core.acquisition.devices import images_per_observation
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.finder import find_circles, fit_light, locate
from tactile_core.algorithms.circles.light import LightModel
from tactile_core.algorithms.circles.press import PressImage, working_scale
from tactile_core.algorithms.circles.start import Start
from tactile_core.algorithms.force.elastic_layer import THICKNESS_MM
from tactile_core.algorithms.heights.sphere import flat_equivalent
from tactile_core.calibration.crew import ALONE, Crew, Task
from tactile_core.calibration.presses import NOT_THIS_GEL, FoundPress
from tactile_core.conditioning.gel_check import GelCheck
from tactile_core.errors import InputError
from tactile_core.formats.catalog import CATALOG_FILE, find_catalog
from tactile_core.interfaces.calibration import Progress
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.recording import open_recording


def find_presses(
    files: Sequence[str],
    frames: Sequence[Frame],
    reference: Reference,
    ball_radius_px: float | Sequence[float],
    *,
    dome_radius_px: float | None = None,
    thickness_mm: float = THICKNESS_MM,
    labels: Mapping[str, Circle] | None = None,
    check: GelCheck | None = None,
    progress: Progress | None = None,
    crew: Crew = ALONE,
) -> list[FoundPress]:
    """Find the contact circle of the ball in each frame, or take it from labels.

    Parameters
    ----------
    files : sequence of str
        Name of each frame's file, for reports.
    frames : sequence of Frame
    reference : Reference
    ball_radius_px : float or sequence of float
        Radius of the ball, of all frames or of each.
    dome_radius_px : float, optional
        Radius of an undeformed domed gel.
    thickness_mm : float
        Thickness of the gel.
    labels : mapping of str to Circle, optional
        Circles by the frame's source. With labels nothing is searched.
    check : GelCheck, optional
        Frames that it does not recognise are no presses.
    progress : Progress, optional
    crew : Crew
        Processes that share the work.

    Returns
    -------
    list of FoundPress
        One per frame, unusable ones included.
    """
    balls_px = list(np.broadcast_to(ball_radius_px, len(frames)).astype(float))
    if labels is not None:
        missing = Circle((0.0, 0.0), 0.0, "it has no row in the labels")
        return [
            FoundPress(
                file,
                frame,
                labels.get(frame.source, missing),
                ball_px,
                dome_radius_px=dome_radius_px,
                thickness_mm=thickness_mm,
            )
            for file, frame, ball_px in zip(files, frames, balls_px, strict=True)
        ]
    touching_px = [flat_equivalent(ball_px, dome_radius_px) for ball_px in balls_px]
    scale = working_scale(max(touching_px))
    starts = crew.run(
        reference,
        [Task(start_of, (frame, px, scale)) for frame, px in zip(frames, touching_px, strict=True)],
        lambda share: progress.fraction(0.3 * share) if progress else None,
    )
    if check is not None:
        reasons = [_refusal(check, frame) for frame in frames]
        starts = [s.refuse_press(why) if why else s for s, why in zip(starts, reasons, strict=True)]
    circles = find_circles(
        starts, progress=lambda share: progress.fraction(0.3 + 0.7 * share) if progress else None
    )
    return [
        FoundPress(file, frame, circle, ball_px, False, dome_radius_px, start, thickness_mm)
        for file, frame, circle, ball_px, start in zip(
            files, frames, circles, balls_px, starts, strict=True
        )
    ]


def _refusal(check: GelCheck, frame: Frame) -> str:
    """Return why a frame does not show the gel of the reference; empty if it does."""
    shown = check(frame)
    return "" if shown.this_gel else f"{NOT_THIS_GEL}: {shown.advice}"


def refound(presses: Sequence[FoundPress]) -> list[FoundPress]:
    """Search the circles of some presses again, as if there were no others."""
    circles = find_circles(_starts(presses))
    return [replace(press, circle=circle) for press, circle in zip(presses, circles, strict=True)]


def start_of(reference: Reference, frame: Frame, ball_radius_px: float, scale: float) -> Start:
    """Analyse a frame on its own, as the start of the search."""
    return Start.from_image(press_image(frame, reference), ball_radius_px, scale)


def press_image(frame: Frame, reference: Reference) -> PressImage:
    """Prepare a frame for circle finding."""
    return PressImage.prepare(
        frame.pixels,
        reference.pixels,
        full_scale=frame.full_scale,
        marker_mask=frame.marker_mask,
        reference_markers=reference.marker_mask,
    )


def light_of(presses: Sequence[FoundPress]) -> LightModel:
    """Fit the forward light model of some presses."""
    return fit_light(_starts(presses), [press.circle for press in presses])


def relocate_press(press: FoundPress, light: LightModel) -> FoundPress:
    """Locate the circle of a held-out press with a light model of other presses."""
    (start,) = _starts([press])
    return replace(press, circle=locate(start, light))


def _starts(presses: Sequence[FoundPress]) -> list[Start]:
    starts = [press.start for press in presses if press.start is not None]
    assert len(starts) == len(presses), "the circle of a press with a given place is not searched"
    return starts


class TARGET:
    """Plausibility limits of balls and labels. Nothing sets them from outside: they catch typos."""

    # [mm] Larger diameters are refused. Source: by hand, far beyond any tactile sensor.
    largest_ball_mm = 1000.0
    # [ball radii] Largest radius of a labelled circle. Circles drawn by hand include the dark rim
    # around the ball; the ball's own radius limits the training pixels. Source: published labels
    # have up to 1.18 (``tests/formats/test_labels.py``), plus a margin.
    widest_label = 1.25


_A_CATALOG = f"a {CATALOG_FILE} in the folder of presses"


def ball_diameters_mm(
    profile: Profile, presses: Path, count: int, others_mm: float | None
) -> tuple[float, ...]:
    """Return the diameter of the ball in each observation of a recording.

    Parameters
    ----------
    profile : Profile
    presses : Path
        Its ``catalog.csv`` rules where it lists an observation.
    count : int
        Number of observations.
    others_mm : float, optional
        Diameter in observations that no catalogue lists.

    Raises
    ------
    InputError
        The diameter of an observation is missing.
    """
    catalog = find_catalog(presses) if presses.is_dir() else None
    if catalog is None:
        if others_mm is None:
            other = presses / CATALOG_FILE
            raise InputError(
                f"the ball's diameter is missing; give --ball-diameter-mm (or --target, or "
                f"{f'the columns file,diameter_mm in {other}' if other.is_file() else _A_CATALOG})"
            )
        return (others_mm,) * count
    catalog.check_listed()
    files = open_recording(presses, images_per_observation=images_per_observation(profile)).files
    listed = [catalog.diameter_mm(file.paths[0]) for file in files]
    missing = [file.name for file, size in zip(files, listed, strict=True) if size is None]
    if missing and others_mm is None:
        raise InputError(
            f"{catalog.path} has no diameter of the ball in {missing[0]}; add a line, or give "
            f"--ball-diameter-mm for all that it does not list"
        )
    return tuple(size if size is not None else float(others_mm or 0) for size in listed)


def size_words(diameters_mm: Sequence[float]) -> str:
    """Return ``a ball of 4 mm`` or ``balls of 4 and 6.31 mm``."""
    *rest, last = (f"{diameter:g}" for diameter in diameters_mm)
    return f"balls of {', '.join(rest)} and {last} mm" if rest else f"a ball of {last} mm"


def check_ball(diameter_mm: float, profile: Profile) -> None:
    """Check that a diameter is plausible at the profile's scale.

    Raises
    ------
    InputError
        It is not positive, above a metre, or below two pixels.
    """
    if not 0 < diameter_mm <= TARGET.largest_ball_mm:
        raise InputError(
            f"a ball of {diameter_mm:g} mm? --ball-diameter-mm must be positive and at most "
            f"{TARGET.largest_ball_mm:g}"
        )
    if diameter_mm / 2 < profile.image.mm_per_px:
        raise InputError(
            f"a ball of {diameter_mm:g} mm is smaller than two pixels of "
            f"{profile.image.mm_per_px:g} mm; correct its diameter or 'image.mm_per_px'"
        )
