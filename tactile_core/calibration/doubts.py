"""What contradicts a calibration, in sentences for the user."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_core.calibration.score import Score
from tactile_core.calibration.target_surface import TargetSurface


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
    # [ratio] Largest difference between two halves, over the error of predicting a flat surface.
    # Source: by hand, independent errors of both halves then amount to a sixth of all that there
    # is to measure.
    halves = 0.25


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
    said = (_radius(score), _offset(score, ball_px), _left_out_size(score), _halves(score))
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


def _halves(score: Score) -> str:
    difference_deg = score.halves_difference_deg
    if difference_deg is None or difference_deg <= DOUBTS.halves * score.predict_flat_deg:
        return ""
    return (
        f"calibrations on two halves of the presses measure normals that differ by "
        f"{difference_deg:.1f}°: record more presses, all over the image"
    )


def _ball_radius_px(used: Sequence[TargetSurface]) -> float:
    sizes_px = [
        surface.ball_diameter_mm / 2 / surface.frame.mm_per_px
        for surface in used
        if surface.ball_diameter_mm is not None
    ]
    return min(sizes_px, default=float("inf"))
