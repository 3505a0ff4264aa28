"""Where the light of each channel comes from, learned from presses of a ball."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tactile_core.acquisition.assembly import lights_of
from tactile_core.calibration.fitting import AZIMUTHS, channel_azimuths
from tactile_core.calibration.targets import balls
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.pipeline.playback import make_lights, read_frames
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference
from tactile_core.scaffold.finding import Finding

WIDEST_CONTACT = 0.95
"""Of the ball's radius, by the median press: at the right scale 0.73 to 0.88 on real recordings,
and 0.97 at one that is a quarter too large."""


def find_lights(
    profile: Profile,
    parent: str,
    presses: Path,
    undeformed: Reference,
    *,
    ball_diameter_mm: float | None = None,
    target: Path | None = None,
    progress: Progress | None = None,
) -> list[Finding]:
    """Learn the lights' azimuths from presses, and say how they lie to those of the parent.

    Parameters
    ----------
    profile : Profile
        With the image section that was found.
    parent : str
        Name of the profile that it extends, for the comments.
    presses, ball_diameter_mm, target
        As for :func:`tactile_core.calibration.fitting.calibrate`.
    undeformed : Reference

    Raises
    ------
    InputError, CalibrationError
        The presses cannot be read, or none shows a ball of this size at this scale.
    """
    frames = list(read_frames(profile, presses))
    condition = Conditioning.of(profile, undeformed, compensates=False)
    undeformed = condition.undeformed
    known = balls(
        profile,
        presses,
        frames,
        condition,
        ball_diameter_mm=ball_diameter_mm,
        target=target,
        progress=progress or Silent(),
    )
    good = [press for press in known.surfaces if press.used]
    learned = dict(zip(undeformed.channels, channel_azimuths(good, undeformed), strict=True))
    basis = (
        f"{len(good)} of {len(known.surfaces)} presses of a ball of {known.ball_diameter_mm:g} mm"
    )
    findings = [_azimuths(profile, learned, parent, basis)]
    usual = np.median([press.radius_px / press.ball_radius_px for press in good])
    if target is None and usual > WIDEST_CONTACT:
        text = (
            f"At this scale the ball of {known.ball_diameter_mm:g} mm would touch as wide as it "
            f"is, so mm_per_px is likely too large."
        )
        findings.append(Finding("image", text, noted=True))
    return findings


def _azimuths(profile: Profile, learned: Mapping[str, float], parent: str, basis: str) -> Finding:
    lights = lights_of(make_lights(profile))
    found = "light comes from " + ", ".join(f"{round(a)}° ({name})" for name, a in learned.items())
    if {light.name for light in lights} != set(learned):
        text = (
            f"By {basis} {found}; {parent} does not tell its lamps by channel, so "
            f"nothing is written. Calibration learns them anyway."
        )
        return Finding("illumination", text)
    said = np.array([light.azimuth_deg for light in lights])
    seen = np.array([learned[light.name] for light in lights])
    if _fit(seen, said):
        text = f"By {basis} {found}, much as {parent} says."
        return Finding("illumination", text)
    text = f"By {basis} {found}; 0° is right, 90° down."
    if len(lights) == 3 and _fit(seen[::-1], said):
        text += (
            f" With the first and the last channel swapped it would be as {parent} says: the "
            f"recording may be BGR instead of RGB, or mirrored."
        )
    else:
        turn = float(np.degrees(np.angle(np.exp(1j * np.radians(seen - said)).mean())))
        if _fit(seen - turn, said):
            text += f" All are turned by {round(turn)}° against {parent}'s."
        else:
            text += f" {parent} has them elsewhere and in another order."
    as_said = profile.illumination.options.get("lights")
    if as_said is None:
        return Finding("illumination", text)
    written = [{**light, "azimuth_deg": round(learned[light["name"]])} for light in as_said]
    return Finding("illumination", text, {"lights": written})


def _fit(seen_deg: np.ndarray, said_deg: np.ndarray) -> bool:
    off = np.abs((seen_deg - said_deg + 180) % 360 - 180)
    return bool((off <= AZIMUTHS.tolerance_deg).all())
