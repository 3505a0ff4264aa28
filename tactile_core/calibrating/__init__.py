"""Calibrate one physical unit: find the presses, fit, score on held-out ones, bundle."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core import __version__
from tactile_core.acquisition import average
from tactile_core.bundle import Bundle, Manifest, check_serial, now
from tactile_core.calibrating.presses import FoundPress, find_grid, find_presses, used
from tactile_core.calibrating.scoring import Score, cross_validate
from tactile_core.calibration import Calibration, Press
from tactile_core.errors import InputError
from tactile_core.exposures import in_turn, pattern_of, verify
from tactile_core.marks import MarkFinder
from tactile_core.plugins import resolve
from tactile_core.profiles.loader import load_profile, profile_hash
from tactile_core.profiles.model import Component, Profile
from tactile_core.progress import Progress, Silent
from tactile_core.quantities import Frame, Reference
from tactile_core.recording import open_recording
from tactile_core.sensor import images_per_observation, played_back, read_frames

BALL_TOLERANCE = 0.01
AZIMUTH_TOLERANCE_DEG = 25.0
"""A profile's azimuths are where a calibration starts; further off, something is mixed up."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A bundle that is ready to save, and how it came about."""

    bundle: Bundle
    presses: tuple[FoundPress, ...]
    score: Score | None
    notes: tuple[str, ...] = ()

    def save(self, directory: Path) -> None:
        """Write the bundle with its report, whole or not at all."""
        from tactile_core.calibrating.report import write_report

        self.bundle.save(directory, report=lambda folder: write_report(self, folder))

    def summary(self, directory: Path) -> dict[str, Any]:
        """What ``tactile calibrate --json`` prints."""
        return {
            "bundle": str(directory),
            "model": self.bundle.manifest.model,
            "presses": [
                {
                    "file": press.file,
                    "centre_px": [round(float(v), 3) for v in press.circle.centre_px],
                    "contact_radius_px": round(float(press.circle.contact_radius_px), 3),
                    "used": press.circle.used,
                    "why": press.circle.why,
                }
                for press in self.presses
            ],
            "held_out": None if self.score is None else self.score.summary(),
            "coverage": self.coverage(),
        }

    def coverage(self) -> dict[str, float]:
        """Steepest slope that was pressed, and the share of the image that some press covered."""
        good = [press for press in self.presses if press.circle.used]
        seen = np.zeros(good[0].frame.pixels.shape[:2], bool)
        steepest = 0.0
        for press in good:
            seen |= press.disc(press.circle.contact_radius_px)
            slopes = press.training().gradients
            steepest = max(steepest, float(np.hypot(slopes[:, 0], slopes[:, 1]).max()))
        return {
            "slope_deg_max": round(float(np.degrees(np.arctan(steepest))), 2),
            "image_fraction": round(float(seen.mean()), 4),
        }


def calibrate(
    profile: Profile | str | Path,
    presses: Path,
    reference: Path,
    *,
    ball_diameter_mm: float | None = None,
    labels: Path | None = None,
    target: Path | None = None,
    model: str | None = None,
    serial: str = "",
    progress: Progress | None = None,
) -> Calibrated:
    """Fit and score a calibration from recorded presses of a ball.

    Parameters
    ----------
    profile : Profile, str or Path
    presses : Path
        A recording in which each observation shows the ball pressed somewhere.
    reference : Path
        A recording of the untouched sensor.
    ball_diameter_mm : float
        Not needed with a ``target``, whose radius rules.
    labels : Path, optional
        CSV of circles that overrule the automatic ones.
    target : Path, optional
        A grid of balls: YAML with ``radius`` and circle centres.
    model : str, optional
        ``plugin.name`` of a calibration instead of the profile's.
    serial : str
        Which physical unit this is.

    Raises
    ------
    InputError, ProfileError, CalibrationError
        Something given is unusable; the message says what to do.
    """
    progress = progress or Silent()
    if serial:
        check_serial(serial)
    base = profile if isinstance(profile, Profile) else load_profile(profile)
    base, notes = played_back(base, presses)
    frames = list(read_frames(base, presses))
    files = _file_names(base, presses, frames)
    bare = list(read_frames(base, reference))
    untouched = average(bare)
    _verify([*bare, *frames], untouched)
    finder = MarkFinder.of(base, untouched)
    if finder is not None:
        untouched = replace(untouched, marks=finder.find(untouched.pixels))
        frames = [replace(frame, marks=finder.find(frame.pixels)) for frame in frames]
    found, radius_mm = _found(
        base, presses, files, frames, untouched, ball_diameter_mm, labels, target, progress
    )
    good = used(found)
    component = base.calibration if model is None else Component(use=model)
    cls: type[Calibration] = resolve("calibration", component.use)
    options = cls.Options.model_validate(component.options)

    def fit(samples: Sequence[Press]) -> Calibration:
        return cls.fit(samples, untouched, options)

    progress.stage("scoring on held-out presses", 0.6)
    score = cross_validate(good, untouched, fit, relocate=labels is None, progress=progress)
    progress.stage("fitting", 0.15)
    fitted = fit([press.training() for press in good])
    progress.fraction(1.0)
    azimuths = _channel_azimuths(good, untouched)
    if in_turn(frames[0]):
        notes = (*notes, *_misplaced(base, untouched.channels, azimuths))
    manifest = Manifest(
        profile=base.name,
        revision=base.revision,
        serial=serial,
        model=getattr(type(fitted), "USE", component.use),
        image_size_px=(base.image.width_px, base.image.height_px),
        crop=base.image.crop,
        channels=untouched.channels,
        channel_azimuth_deg=azimuths,
        mm_per_px=base.image.mm_per_px,
        bit_depth=base.image.bit_depth,
        created=now(),
        ball_diameter_mm=2 * radius_mm,
        presses_used=len(good),
        held_out=None if score is None else score.summary(),
        versions=_versions(),
        profile_hash=profile_hash(base),
    )
    return Calibrated(Bundle(manifest, fitted, untouched), tuple(found), score, notes)


def _verify(frames: Sequence[Frame], untouched: Reference) -> None:
    expected = pattern_of(untouched)
    for frame in frames:
        if in_turn(frame):
            verify(frame, expected, f"observation {frame.source or frame.sequence}")


def _file_names(profile: Profile, path: Path, frames: list[Frame]) -> list[str]:
    """Name of each frame's image file; of its observation where that is no single file."""
    count = images_per_observation(profile)
    recording = open_recording(path, images_per_observation=count)
    single = {files.name: files.paths[0].name for files in recording.files if count == 1}
    return [single.get(frame.source, frame.source) for frame in frames]


def _found(
    profile: Profile,
    presses: Path,
    files: list[str],
    frames: list[Frame],
    reference: Reference,
    ball_diameter_mm: float | None,
    labels: Path | None,
    target: Path | None,
    progress: Progress,
) -> tuple[list[FoundPress], float]:
    scale = profile.image.mm_per_px
    progress.stage("finding the circles", 0.25)
    if target is not None:
        return _on_target(profile, presses, files, frames, reference, ball_diameter_mm, target)
    if ball_diameter_mm is None:
        raise InputError("how large is the ball? give --ball-diameter-mm (or --target)")
    if not ball_diameter_mm > 0:
        raise InputError(f"a ball of {ball_diameter_mm:g} mm? --ball-diameter-mm must be positive")
    radius_mm = ball_diameter_mm / 2
    given: Mapping[str, Any] | None = None
    if labels is not None:
        from tactile_core.formats.labels import read_labels

        given = read_labels(labels)
    found = find_presses(
        files, frames, reference, radius_mm / scale, labels=given, progress=progress
    )
    return found, radius_mm


def _on_target(
    profile: Profile,
    presses: Path,
    files: list[str],
    frames: list[Frame],
    reference: Reference,
    ball_diameter_mm: float | None,
    target: Path,
) -> tuple[list[FoundPress], float]:
    from tactile_core.formats.target import read_target
    from tactile_core.geometry import ImageGeometry

    grid = read_target(target)
    if ball_diameter_mm is not None:
        off = abs(ball_diameter_mm / (2 * grid.radius_mm) - 1)
        if off > BALL_TOLERANCE:
            raise InputError(
                f"{target} says a ball of {2 * grid.radius_mm:g} mm and --ball-diameter-mm "
                f"{ball_diameter_mm:g}; leave the option out or correct it"
            )
    if len(frames) != 1:
        raise InputError(
            f"a target describes one observation and {len(frames)} were given; give --presses the "
            f"one image or scan that shows the grid"
        )
    camera_size_px = open_recording(
        presses, images_per_observation=images_per_observation(profile)
    ).size_px
    geometry = ImageGeometry(profile.image)
    grid = grid.at_scale(geometry.camera_mm_per_px(camera_size_px))
    centres = geometry.map_points(grid.centres_px, camera_size_px)
    radius_px = grid.radius_mm / profile.image.mm_per_px
    return find_grid(files[0], frames[0], reference, radius_px, centres), grid.radius_mm


def _channel_azimuths(presses: Sequence[FoundPress], reference: Reference) -> tuple[float, ...]:
    """Azimuth from which each channel's light comes, degrees from x towards y.

    To first order a channel brightens where the surface turns towards its lamp, and a surface of
    slope g has the normal (−g, 1).
    """
    slopes, changes = [], []
    for press in presses:
        sample = press.training()
        at = (sample.rows, sample.columns)
        slopes.append(sample.gradients)
        changes.append(press.frame.pixels[at].astype(np.float64) - reference.pixels[at])
    response, *_ = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(changes), rcond=None)
    azimuths = np.degrees(np.arctan2(-response[1], -response[0]))
    return tuple(round(float(a), 1) for a in azimuths)


def _misplaced(
    profile: Profile, channels: Sequence[str], learned_deg: Sequence[float]
) -> tuple[str, ...]:
    """Warn of lamps that shine from elsewhere than the profile says."""
    lights = profile.illumination.options.get("lights", ())
    said = {light["name"]: float(light["azimuth_deg"]) for light in lights}
    pairs = [(c, a) for c, a in zip(channels, learned_deg, strict=True) if c in said]

    def off_deg(name: str, azimuth_deg: float) -> float:
        return abs((azimuth_deg - said[name] + 180) % 360 - 180)

    far = [(name, a) for name, a in pairs if off_deg(name, a) > AZIMUTH_TOLERANCE_DEG]
    if not far:
        return ()
    nearest = []
    for _, azimuth in pairs:
        nearest.append(min((off_deg(name, azimuth), name) for name in said)[1])
    where = ", ".join(f"{name} from {a:.0f}° (profile {said[name]:.0f}°)" for name, a in far)
    if len(set(nearest)) == len(nearest) and nearest != [name for name, _ in pairs]:
        return (
            f"lights shine from elsewhere than the profile says: {where}; they fit in the order "
            f"{', '.join(nearest)}, so correct the profile or the order of the images",
        )
    return (f"lights shine from elsewhere than the profile says: {where}; correct 'azimuth_deg'",)


def _versions() -> dict[str, str]:
    import cv2

    return {
        "tactile-core": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
    }
