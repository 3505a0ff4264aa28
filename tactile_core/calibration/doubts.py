"""What is doubtful about a calibration, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from tactile_core.algorithms.markers.count import find_marker_lattice
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.score import Score
from tactile_core.calibration.target_surface import TargetSurface
from tactile_core.interfaces.gel import Gel, Markers
from tactile_core.quantities import Reference


class DOUBTS:
    """Limits of a calibration that is not doubted. Nothing sets them: they only warn."""

    # [ratio] Largest deviation of the median sphere's radius from the ball's. Source: by hand,
    # heights are wrong by the same share.
    radius_error = 0.1
    # [ball radii] Largest distance between the centres of a sphere and of its circle, 90th
    # percentile. Source: eight virtual sensors that differ in light, coating and ball, ten
    # presses each: at most 0.013 with true circles, at least 0.078 with circles that are shifted
    # by 0.15 ball radii or drift to 0.35 on one side (ADR 45). Slopes are then off by about as
    # much, 4°.
    offset = 0.07


_NOTHING_HELD_OUT = (
    "only one press can be used, so nothing was held out and the accuracy of this calibration is "
    "unknown; record more presses"
)


def doubts(score: Score | None, used: Sequence[TargetSurface]) -> tuple[str, ...]:
    """Return what contradicts a calibration that was to be scored; empty if nothing does.

    Parameters
    ----------
    score : Score or None
        None if nothing could be held out.
    used : sequence of TargetSurface
        The surfaces that it was fitted on.
    """
    if score is None:
        return (_NOTHING_HELD_OUT,)
    if not score.mean_deg < score.predict_flat_deg:
        return (
            f"on held-out presses the mean error of this calibration is {score.mean_deg:.1f}°, no "
            f"better than assuming a flat surface ({score.predict_flat_deg:.1f}°): do not measure "
            f"with it; check the labels, the ball's diameter and the reference",
        )
    ball_px = _ball_radius_px(used)
    said = (_radius(score), _offset(score, ball_px), _left_out_size(score))
    return tuple(sentence for sentence in said if sentence)


def _radius(score: Score) -> str:
    radii = score.sphere_quartiles()
    if radii is None or abs(radii[1] - 1) <= DOUBTS.radius_error:
        return ""
    if radii[1] <= 0:
        return (
            "held-out presses are measured as hollows instead of spheres: do not measure with this "
            "calibration; check the circles in report.html and the reference"
        )
    return (
        f"spheres in the height maps of held-out presses have {radii[1]:.2f} of the ball's radius, "
        f"so heights are wrong by about as much: check the circles in report.html and the "
        f"reference, and record more presses"
    )


def _offset(score: Score, ball_radius_px: float) -> str:
    offsets = score.sphere_offsets_px()
    if offsets is None or offsets[1] <= DOUBTS.offset * ball_radius_px:
        return ""
    return (
        f"the spheres in the height maps of held-out presses are not where the circles were found "
        f"(up to {offsets[1]:.1f} px away): check the circles in report.html, the doubtful ones "
        f"are first"
    )


def _left_out_size(score: Score) -> str:
    ratio = score.left_out_size_ratio
    if ratio is None or abs(ratio - 1) <= DOUBTS.radius_error:
        return ""
    return (
        f"a ball size that was left out is measured with {ratio:.2f} of its radius: check the "
        f"diameter of each ball"
    )


def _ball_radius_px(used: Sequence[TargetSurface]) -> float:
    sizes_px = [
        surface.ball_diameter_mm / 2 / surface.frame.mm_per_px
        for surface in used
        if surface.ball_diameter_mm is not None
    ]
    return min(sizes_px, default=float("inf"))


def implausible(
    presses: Sequence[TargetSurface], reference: Reference, gel: Gel
) -> tuple[str, ...]:
    """Return what contradicts the diameter of the ball, the scale or the gel; empty if nothing.

    Parameters
    ----------
    presses : sequence of TargetSurface
        All that were found; only balls are examined.
    reference : Reference
        The undeformed sensor.
    gel : Gel
        Thickness and markers of the profile.
    """
    balls = [press for press in presses if isinstance(press, FoundPress)]
    separate = [ball for ball in balls if not ball.in_grid]
    scale = presses[0].frame.mm_per_px
    said = (
        _pitch(reference, gel, scale),
        _report_unused(separate),
        _wide(separate),
        _deep(balls, gel),
    )
    return tuple(sentence for sentence in said if sentence)


def _pitch(reference: Reference, gel: Gel, mm_per_px: float) -> str:
    """Compare the pitch of the markers in the image with the profile's."""
    if not isinstance(gel.markers, Markers):
        return ""
    found = find_marker_lattice(np.asarray(reference.pixels))
    if found is None:
        return ""
    pitch_mm = found.pitch_px * mm_per_px
    # [ratio] Largest deviation of the marker pitch in the reference from the profile's. Source: by
    # hand, larger than the perspective of a tilted camera leaves, and as much as a calibration's
    # radius may be off before it is reported.
    if abs(pitch_mm / gel.markers.pitch_mm - 1) <= 0.1:
        return ""
    return (
        f"the markers of the reference are {pitch_mm:.2f} mm apart at {mm_per_px:g} mm per pixel, "
        f"not {gel.markers.pitch_mm:g} mm as in the profile: check 'image.mm_per_px' and "
        f"'gel.markers', for every slope depends on the scale"
    )


def _report_unused(balls: Sequence[FoundPress]) -> str:
    """Count the usable presses of each size: those of a wrong size may be the ones left out."""
    for size_mm in sorted({ball.ball_diameter_mm for ball in balls}):
        those = [ball for ball in balls if ball.ball_diameter_mm == size_mm]
        used = sum(ball.used for ball in those)
        # [ratio] A smaller share of usable presses is reported. Source: by hand, the majority
        # should be presses of the given ball.
        if used >= 0.5 * len(those):
            continue
        ((reason, _),) = Counter(ball.why for ball in those if not ball.used).most_common(1)
        return (
            f"only {used} of {len(those)} presses of the ball of {size_mm:g} mm can be used "
            f"({reason}): check its diameter, 'image.mm_per_px' and the reference"
        )
    return ""


def _wide(balls: Sequence[FoundPress]) -> str:
    # [ball radii] A wider contact indicates that the ball is larger than said, or the scale
    # smaller. Source: the gel would have to rise to 72° around the ball; 0.94 is the largest on
    # recordings of four real sensors. With diameters a fifth to a half too small the widest was
    # 0.97 when the border was that of a shape (ADR 45).
    limit = 0.95
    used = [ball for ball in balls if ball.used]
    wide = [ball for ball in used if ball.radius_px > limit * ball.ball_radius_px]
    # [ratio] A smaller share of such presses is that of circles that are wrong. Source: of 24
    # presses of a real sensor one had such a circle; with diameters a fifth to a half too small, a
    # tenth and more of the presses.
    if len(wide) <= 0.05 * len(used):
        return ""
    return (
        f"the contact is as wide as the ball in {len(wide)} of {len(balls)} presses, e.g. in "
        f"{wide[0].file}: the ball is larger than {wide[0].ball_diameter_mm:g} mm, or "
        f"'image.mm_per_px' is too large"
    )


def _deep(balls: Sequence[FoundPress], gel: Gel) -> str:
    """Compare the height of the cap inside the contact with the thickness of the gel."""
    if gel.thickness_mm is None:
        return ""
    for ball in balls:
        share = min(ball.radius_px / ball.ball_radius_px, 1.0)
        cap_mm = ball.ball_diameter_mm / 2 * float(1 - np.sqrt(1 - share**2))
        if ball.used and cap_mm > gel.thickness_mm:
            return (
                f"a ball of {ball.ball_diameter_mm:g} mm with the contact of {ball.file} would be "
                f"{cap_mm:.1f} mm deep in a gel of {gel.thickness_mm:g} mm: check its diameter, "
                f"'image.mm_per_px' and 'gel.thickness_mm'"
            )
    return ""
