"""Whether ball, scale and gel can be true together, in sentences for the user.

Photometry alone does not reveal it: a ball that is said to be larger makes every slope smaller, and
any light could have made the same image. Contacts and markers can.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from tactile_core.algorithms.markers import find_marker_diameter
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.target_surface import TargetSurface
from tactile_core.interfaces.gel import Gel, Markers
from tactile_core.quantities import Reference


class PLAUSIBILITY:
    """Limits of what is plausible. Nothing sets them from outside: they only warn."""

    # [ball radii] A wider contact indicates that the ball is larger than said, or the scale
    # smaller. Source: the gel would have to rise to 72° around the ball; 0.94 is the largest on
    # recordings of four real sensors. With diameters a fifth to a half too small the widest was
    # 0.97 when the border was that of a shape (ADR 45).
    widest_contact = 0.95
    # [ratio] A smaller share of such presses is that of circles that are wrong. Source: of 24
    # presses of a real sensor one had such a circle; with diameters a fifth to a half too small,
    # a tenth and more of the presses.
    fewest_wide = 0.05
    # [ratio] A smaller share of usable presses is reported. Source: by hand, the majority should
    # be presses of the given ball.
    fewest_used = 0.5
    # [ratio] Largest deviation of the marker pitch in the reference from the profile's. Source:
    # by hand, larger than the perspective of a tilted camera leaves, and as much as a
    # calibration's radius may be off before it is reported.
    pitch_tolerance = 0.1


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
    said = (_pitch(reference, gel, scale), _unused(separate), _wide(separate), _deep(balls, gel))
    return tuple(sentence for sentence in said if sentence)


def _pitch(reference: Reference, gel: Gel, mm_per_px: float) -> str:
    """Compare the pitch of the markers in the image with the profile's."""
    if not isinstance(gel.markers, Markers):
        return ""
    found = find_marker_diameter(np.asarray(reference.pixels))
    if found is None:
        return ""
    pitch_mm = found[1] * mm_per_px
    if abs(pitch_mm / gel.markers.pitch_mm - 1) <= PLAUSIBILITY.pitch_tolerance:
        return ""
    return (
        f"the markers of the reference are {pitch_mm:.2f} mm apart at {mm_per_px:g} mm per pixel, "
        f"not {gel.markers.pitch_mm:g} mm as in the profile: check 'image.mm_per_px' and "
        f"'gel.markers', for every slope depends on the scale"
    )


def _unused(balls: Sequence[FoundPress]) -> str:
    """Count the usable presses of each size: those of a wrong size may be the ones left out."""
    for size_mm in sorted({ball.ball_diameter_mm for ball in balls}):
        those = [ball for ball in balls if ball.ball_diameter_mm == size_mm]
        used = sum(ball.used for ball in those)
        if used >= PLAUSIBILITY.fewest_used * len(those):
            continue
        ((reason, _),) = Counter(ball.why for ball in those if not ball.used).most_common(1)
        return (
            f"only {used} of {len(those)} presses of the ball of {size_mm:g} mm can be used "
            f"({reason}): check its diameter, 'image.mm_per_px' and the reference"
        )
    return ""


def _wide(balls: Sequence[FoundPress]) -> str:
    limit = PLAUSIBILITY.widest_contact
    used = [ball for ball in balls if ball.used]
    wide = [ball for ball in used if ball.radius_px > limit * ball.ball_radius_px]
    if len(wide) <= PLAUSIBILITY.fewest_wide * len(used):
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
