"""Markers and lights of a new sensor, from its pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.acquisition.assembly import lights_of
from tactile_core.algorithms.markers import detectable_diameter, expected_count
from tactile_core.algorithms.markers.count import COUNT
from tactile_core.calibration.light_range import AZIMUTHS, channel_azimuths
from tactile_core.calibration.press_search import size_words
from tactile_core.calibration.targets import balls
from tactile_core.conditioning.conditioning import ONLY_DARK, Conditioning
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibrator import Progress, Silent
from tactile_core.pipeline.playback import make_lights, read_frames
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Pixels, Reference


@dataclass(frozen=True)
class PictureFinding:
    """Keys of one section of a profile, and the origin of their values.

    Attributes
    ----------
    section : str
        ``image`` or ``gel``, for example.
    comment : str
        Meaning and origin of the keys, in a sentence or two.
    values : mapping
        Keys and values for the file; empty if the parent's values are inherited.
    noted : bool
        Also reported to the user: the values are inherited instead of measured, or doubtful.
    """

    section: str
    comment: str
    values: Mapping[str, Any] = field(default_factory=dict)
    noted: bool = False


@dataclass(frozen=True)
class FoundMarkers:
    """Typical diameter and pitch of the markers in the resulting image, and their number."""

    diameter_px: float
    pitch_px: float
    count: int
    expected: int

    @property
    def fits(self) -> bool:
        """Whether the number of markers fits their pitch."""
        return self.count >= COUNT.least_share * self.expected


def find_markers(exposures: Sequence[Pixels]) -> FoundMarkers | None:
    """Detect whether the gel has printed markers, and their size.

    Parameters
    ----------
    exposures : sequence of (H, W) or (H, W, 3)
        Exposures of one observation in the resulting image.

    Returns
    -------
    FoundMarkers, or None without a lattice of markers
    """
    brightest = _brightest(exposures)
    found = detectable_diameter(brightest)
    return (
        None if found is None else FoundMarkers(*found, expected_count(brightest.shape, found[1]))
    )


def _brightest(exposures: Sequence[Pixels]) -> np.ndarray:
    """Return each pixel's maximum over all lights: ink is dark in all, a slope bright in one."""
    planes = np.concatenate([np.atleast_3d(exposure) for exposure in exposures], axis=2)
    level = np.maximum(np.median(planes.reshape(-1, planes.shape[2]), axis=0), 1.0)
    return np.asarray((planes / level.astype(np.float32)).max(axis=2))


def markers_finding(
    markers: FoundMarkers | None, parent: Profile, mm_per_px: float, name: str
) -> PictureFinding | None:
    """Return the finding for the profile; None if neither gel has markers."""
    if markers is not None:
        pitch_mm, diameter_mm = markers.pitch_px * mm_per_px, markers.diameter_px * mm_per_px
        unlike = parent.gel.markers is None
        doubt = f" {parent.name}'s gel has none." if unlike else ""
        if not markers.fits:
            doubt += (
                f" DOUBTFUL: about {markers.expected} would fill the image. Increase the diameter "
                f"until 'tactile run' reports most of them, or give a sharper image."
            )
        return PictureFinding(
            "gel",
            f"Pitch and diameter of the printed markers: {markers.pitch_px:.1f} and "
            f"{markers.diameter_px:.1f} px in {name}, with which {markers.count} are found.{doubt}",
            {
                "markers": {
                    "pitch_mm": float(f"{pitch_mm:.3g}"),
                    "diameter_mm": float(f"{diameter_mm:.2g}"),
                }
            },
            noted=unlike or not markers.fits,
        )
    if parent.gel.markers is None:
        return None
    return PictureFinding(
        "gel",
        f"{name} shows no lattice of markers, although {parent.name}'s gel has one. If this gel "
        f"has markers, set {{pitch_mm: …, diameter_mm: …}}; otherwise they are measured as dents "
        f"({ONLY_DARK}).",
        {"markers": None},
        noted=True,
    )


class PICTURE_CONTACT:
    """Parameters of the check of the scale. Nothing sets them from outside: it only warns."""

    # [ball radii] A larger median contact radius indicates that the scale is too large. Source:
    # 0.73 to 0.88 on recordings of three real sensors, and 0.97 at a scale a quarter too large
    # (ADR 17).
    widest_contact = 0.95


def find_lights(
    profile: Profile,
    parent: str,
    presses: Path,
    undeformed: Reference,
    *,
    ball_diameter_mm: float | None = None,
    target: Path | None = None,
    progress: Progress | None = None,
) -> list[PictureFinding]:
    """Estimate the azimuths of the lights from presses and compare them with the parent's.

    Parameters
    ----------
    profile : Profile
        With the ``image`` section that was found.
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
    condition = Conditioning.for_build(profile, undeformed, compensates=False)
    undeformed = condition.undeformed
    ground_truth = balls(
        profile,
        presses,
        frames,
        condition,
        ball_diameter_mm=ball_diameter_mm,
        target=target,
        progress=progress or Silent(),
    )
    good = [press for press in ground_truth.surfaces if press.used]
    learned = dict(zip(undeformed.channels, channel_azimuths(good, undeformed), strict=True))
    sizes = size_words(ground_truth.ball_diameters_mm)
    basis = f"{len(good)} of {len(ground_truth.surfaces)} presses of {sizes}"
    findings = [_azimuths(profile, learned, parent, basis)]
    median_share = np.median([press.radius_px / press.ball_radius_px for press in good])
    if target is None and median_share > PICTURE_CONTACT.widest_contact:
        text = (
            f"At this scale the contact would be as wide as {sizes}, so mm_per_px is likely too "
            f"large."
        )
        findings.append(PictureFinding("image", text, noted=True))
    return findings


def unmeasured_lights(parent: str, error: CalibrationError) -> PictureFinding:
    """Return the finding for presses of which none can be used."""
    text = (
        f"NOT MEASURED: {error}. The directions of the lights are {parent}'s until 'tactile "
        f"calibrate' learns them."
    )
    return PictureFinding("illumination", text, noted=True)


def _azimuths(
    profile: Profile, learned: Mapping[str, float], parent: str, basis: str
) -> PictureFinding:
    lights = lights_of(make_lights(profile))
    found = "the light comes from " + ", ".join(
        f"{round(a)}° ({name})" for name, a in learned.items()
    )
    if {light.name for light in lights} != set(learned):
        text = (
            f"According to {basis}, {found}. {parent} does not list its lights by channel, so "
            f"nothing is written; the calibration learns the directions anyway."
        )
        return PictureFinding("illumination", text)
    expected = np.array([light.azimuth_deg for light in lights])
    measured = np.array([learned[light.name] for light in lights])
    if _match(measured, expected):
        text = f"According to {basis}, {found}, which agrees with {parent}."
        return PictureFinding("illumination", text)
    text = f"According to {basis}, {found}; 0° is right, 90° down."
    if len(lights) == 3 and _match(measured[::-1], expected):
        text += (
            f" With the first and the last channel swapped it would agree with {parent}: the "
            f"recording may be BGR instead of RGB, or mirrored."
        )
    else:
        turn = float(np.degrees(np.angle(np.exp(1j * np.radians(measured - expected)).mean())))
        if _match(measured - turn, expected):
            text += f" All are rotated by {round(turn)}° relative to {parent}'s."
        else:
            text += f" {parent} has other directions in another order."
    parents = profile.illumination.options.get("lights")
    if parents is None:
        return PictureFinding("illumination", text)
    text += f" Presses do not show elevations: these are {parent}'s, not measured."
    written = [{**light, "azimuth_deg": round(learned[light["name"]])} for light in parents]
    return PictureFinding("illumination", text, {"lights": written})


def _match(measured_deg: np.ndarray, expected_deg: np.ndarray) -> bool:
    off = np.abs((measured_deg - expected_deg + 180) % 360 - 180)
    return bool((off <= AZIMUTHS.tolerance_deg).all())
