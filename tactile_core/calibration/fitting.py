"""Calibrate one physical unit: find what is known, fit, score on what is held out, bundle."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core import __version__
from tactile_core.acquisition.assembly import lights_of
from tactile_core.bundles.bundle import Bundle, check_serial, names_of, now
from tactile_core.bundles.manifest import LIGHT, Manifest
from tactile_core.calibration.height_target import is_height_map
from tactile_core.calibration.known_surface import KnownSurface
from tactile_core.calibration.result import Calibrated
from tactile_core.calibration.scoring import cross_validate
from tactile_core.calibration.targets import Known, balls, rows_of_map, undeformed_sensor
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.conditioning.sequence_check import is_sequential
from tactile_core.errors import InputError
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.pipeline.playback import make_lights, played_back, read_frames
from tactile_core.plugins.calibrators import calibrator_of, fitted_by, smoothing_px_of
from tactile_core.profiles.loader import load_profile, profile_hash
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference
from tactile_core.recordings.inputs import PROFILE, Inputs

AZIMUTH_TOLERANCE_DEG = 25.0
"""A profile's azimuths are where a calibration starts; further off, something is mixed up."""

_USELESS = (
    "on held-out presses this calibration errs by {:.1f}°, no less than 'flat' everywhere would "
    "({:.1f}°): do not measure with it; check the labels, the ball's diameter and the reference"
)


def calibrate(
    profile: Profile | str | Path,
    presses: Path,
    reference: Path | None = None,
    *,
    ball_diameter_mm: float | None = None,
    labels: Path | None = None,
    target: Path | None = None,
    rows: slice | None = None,
    model: str | None = None,
    serial: str = "",
    scored: bool = True,
    progress: Progress | None = None,
) -> Calibrated:
    """Fit and score a calibration from presses of a ball or of a surface that is known.

    Parameters
    ----------
    profile : Profile, str or Path
    presses : Path
        A recording in which each observation shows the ball pressed somewhere; with a target, the
        one observation that shows it.
    reference : Path, optional
        A recording of the untouched sensor. A height map does without: where none is given, or it
        is the press itself, the press's own large-scale light stands in.
    ball_diameter_mm : float
        Not needed with a ``target``, whose radius rules.
    labels : Path, optional
        CSV of circles that overrule the automatic ones.
    target : Path, optional
        A grid of balls: YAML with ``radius`` and circle centres; or a height map (``.tmd``) of the
        very surface in the press.
    rows : slice, optional
        Rows of the height map that may be used.
    model : str, optional
        ``plugin.name`` of a calibrator instead of the profile's.
    serial : str
        Which physical unit this is.
    scored : bool
        False leaves out the cross-validation, which takes several times as long as the fit.

    Raises
    ------
    InputError, ProfileError, CalibrationError
        Something given is unusable; the message says what to do.
    """
    progress = progress or Silent()
    if serial:
        check_serial(serial)
    if rows is not None and not is_height_map(target):
        raise InputError("--rows chooses rows of a height map; give it as --target, a .tmd file")
    base = profile if isinstance(profile, Profile) else load_profile(profile)
    base, notes, _ = played_back(base, presses)
    frames = list(read_frames(base, presses))
    undeformed, stand_in = undeformed_sensor(base, frames, reference, target)
    calibrator = calibrator_of(base.calibration, model)
    condition = Conditioning.of(base, undeformed, compensates=calibrator.compensation == "channel")
    undeformed = condition.undeformed
    # Any model may smooth its images; the truth has to be as smooth as what it sees.
    blur_px = smoothing_px_of(calibrator, base.image.mm_per_px)
    known: Known[Any] = (
        rows_of_map(target, frames[0], condition, rows, blur_px, stands_in=bool(stand_in))
        if target is not None and is_height_map(target)
        else balls(
            base,
            presses,
            frames,
            condition,
            ball_diameter_mm=ball_diameter_mm,
            labels=labels,
            target=target,
            progress=progress,
        )
    )
    good = [surface for surface in known.surfaces if surface.used]

    fit = partial(fitted_by, calibrator)
    score = None
    if scored:
        progress.stage("scoring on held-out presses", 0.6)
        score = cross_validate(known.surfaces, known.without, undeformed, fit, progress=progress)
    progress.stage("fitting", 0.15)
    fitted = fit([*(surface.training() for surface in good), *known.at_rest], undeformed)
    artefacts = {LIGHT: fitted}
    progress.fraction(1.0)
    azimuths = channel_azimuths(good, undeformed)
    if is_sequential(frames[0]):
        notes = (*notes, *_misplaced(base, undeformed.channels, azimuths))
    manifest = Manifest(
        profile=base.name,
        revision=base.revision,
        serial=serial,
        artefacts=names_of(artefacts),
        image_size_px=(base.image.width_px, base.image.height_px),
        crop=base.image.crop,
        channels=undeformed.channels,
        channel_azimuth_deg=azimuths,
        mm_per_px=base.image.mm_per_px,
        bit_depth=base.image.bit_depth,
        created=now(),
        ball_diameter_mm=known.ball_diameter_mm,
        presses_used=len(good),
        held_out=None if score is None else score.summary(),
        versions=_versions(),
        profile_hash=profile_hash(base),
    )
    if score is not None and not score.mean_deg < score.predict_flat_deg:
        notes = (*notes, _USELESS.format(score.mean_deg, score.predict_flat_deg))
    bundle = Bundle(manifest, artefacts, undeformed)
    given = inputs_of(profile, presses, reference, labels, target)
    return Calibrated(bundle, tuple(known.surfaces), score, notes + stand_in, known.basis, given)


def inputs_of(
    profile: Profile | str | Path,
    presses: Path,
    reference: Path | None,
    labels: Path | None,
    target: Path | None,
) -> Inputs:
    """What a calibration reads, so that its bundle hits none of it."""
    return Inputs.of(
        {
            PROFILE: None if isinstance(profile, Profile) else profile,
            "--presses": presses,
            "--reference": reference,
            "--labels": labels,
            "--target": target,
        }
    )


def channel_azimuths(presses: Sequence[KnownSurface], reference: Reference) -> tuple[float, ...]:
    """Learn the azimuth from which each channel's light comes, degrees from x towards y.

    To first order a channel brightens where the surface turns towards its lamp, and a surface of
    slope g has the normal (−g, 1).
    """
    slopes, changes = zip(*(press.lighting(reference) for press in presses), strict=True)
    response, *_ = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(changes), rcond=None)
    azimuths = np.degrees(np.arctan2(-response[1], -response[0]))
    return tuple(round(float(a), 1) for a in azimuths)


def _misplaced(
    profile: Profile, channels: Sequence[str], learned_deg: Sequence[float]
) -> tuple[str, ...]:
    """Warn of lamps that shine from elsewhere than the profile says."""
    said = {light.name: light.azimuth_deg for light in lights_of(make_lights(profile))}
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
