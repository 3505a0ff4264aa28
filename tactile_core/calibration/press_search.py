"""Search for the contact circles of ball presses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tactile_core.algorithms.circles import (
    Circle,
    Light,
    PressImage,
    Start,
    find_circles,
    fit_light,
    locate,
    working_scale,
)
from tactile_core.algorithms.dome import flat_equivalent
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.calibration.crew import ALONE, Crew, Task
from tactile_core.calibration.presses import NOT_THIS_GEL, FoundPress
from tactile_core.conditioning.gel_check import GelCheck
from tactile_core.interfaces.progress import Progress
from tactile_core.quantities import Frame, Reference


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
        missing = Circle((0.0, 0.0), 0.0, False, "it has no row in the labels", 0.0)
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
        starts = [s.refused(why) if why else s for s, why in zip(starts, reasons, strict=True)]
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
    return Start.of(press_image(frame, reference), ball_radius_px, scale)


def press_image(frame: Frame, reference: Reference) -> PressImage:
    """Prepare a frame for circle finding."""
    return PressImage.prepare(
        frame.pixels,
        reference.pixels,
        full_scale=frame.full_scale,
        marker_mask=frame.marker_mask,
        reference_markers=reference.marker_mask,
    )


def light_of(presses: Sequence[FoundPress]) -> Light:
    """Fit the forward light model of some presses."""
    return fit_light(_starts(presses), [press.circle for press in presses])


def relocated(press: FoundPress, light: Light) -> FoundPress:
    """Locate the circle of a held-out press with a light model of other presses."""
    (start,) = _starts([press])
    return replace(press, circle=locate(start, light))


def _starts(presses: Sequence[FoundPress]) -> list[Start]:
    starts = [press.start for press in presses if press.start is not None]
    assert len(starts) == len(presses), "the circle of a press with a given place is not searched"
    return starts
