"""Calibrate one physical unit: locate the target, fit, cross-validate, bundle."""

from __future__ import annotations

import platform
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core import __version__
from tactile_core.bundles.bundle import Bundle, check_serial, names_of, now
from tactile_core.bundles.manifest import ERRORS, LIGHT, Manifest
from tactile_core.calibration.doubts import doubts
from tactile_core.calibration.height_target import is_height_map
from tactile_core.calibration.light_directions import channel_azimuths, misplaced_lights
from tactile_core.calibration.plausibility import implausible
from tactile_core.calibration.result import Calibrated
from tactile_core.calibration.scoring import cross_validate
from tactile_core.calibration.targets import (
    CalibrationTarget,
    balls,
    check_ball,
    rows_of_map,
    undeformed_sensor,
)
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.conditioning.sequence_check import is_sequential
from tactile_core.errors import InputError
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.pipeline.playback import played_back, read_frames
from tactile_core.plugins.calibrators import calibrator_of, fitted_by, smoothing_px_of
from tactile_core.profiles.loader import load_profile, profile_hash
from tactile_core.profiles.model import Profile
from tactile_core.recordings.inputs import PROFILE, Inputs


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
    """Fit and score a calibration from presses of a ball or of another calibration target.

    Parameters
    ----------
    profile : Profile, str or Path
    presses : Path
        A recording of the ball, pressed somewhere else in each observation. With a target: a
        recording of the single observation that shows it.
    reference : Path, optional
        A recording of the undeformed sensor. A height map as target does not need it: without a
        reference, or if the reference is the press itself, the large-scale light of the press is
        used.
    ball_diameter_mm : float, optional
        Diameter of the ball in all presses that no ``catalog.csv`` in their folder lists. A
        ``target`` brings its own radius.
    labels : Path, optional
        CSV of circles that replace the automatic ones.
    target : Path, optional
        A grid of balls (YAML with ``radius`` and circle centres) or a height map (``.tmd``) of the
        surface in the press.
    rows : slice, optional
        Rows of the height map to use.
    model : str, optional
        ``plugin.name`` of a calibrator that replaces the profile's.
    serial : str
        Serial of the physical unit.
    scored : bool
        False skips the cross-validation, which takes several times as long as the fit.

    Returns
    -------
    Calibrated

    Raises
    ------
    InputError, ProfileError, CalibrationError
        An input cannot be used; the message names it and the remedy.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
       Estimating Geometry and Force", Sensors 17(12), 2017, section 3.5.
    """
    progress = progress or Silent()
    if serial:
        check_serial(serial)
    if rows is not None and not is_height_map(target):
        raise InputError("--rows chooses rows of a height map; give it as --target, a .tmd file")
    base = profile if isinstance(profile, Profile) else load_profile(profile)
    base, notes, _ = played_back(base, presses)
    if ball_diameter_mm is not None:
        check_ball(ball_diameter_mm, base)
    frames = list(read_frames(base, presses))
    undeformed, stand_in = undeformed_sensor(base, frames, reference, target)
    calibrator = calibrator_of(base.calibration, model)
    condition = Conditioning.of(base, undeformed, compensates=calibrator.compensation == "channel")
    undeformed = condition.undeformed
    miscounted = condition.finder.miscounted(undeformed) if condition.finder else ""
    if miscounted:
        raise InputError(miscounted)
    # Models smooth their images; the ground truth has to be equally smooth.
    blur_px = smoothing_px_of(calibrator, base.image.mm_per_px)
    ground_truth: CalibrationTarget[Any] = (
        rows_of_map(
            target, frames[0], condition, rows, blur_px, reference_from_press=bool(stand_in)
        )
        if target is not None and is_height_map(target)
        else balls(
            base,
            presses,
            frames,
            condition,
            ball_diameter_mm=ball_diameter_mm,
            labels=labels,
            target=target,
            for_heights=calibrator.fits == "heights",
            progress=progress,
        )
    )
    good = [surface for surface in ground_truth.surfaces if surface.used]

    fit = partial(fitted_by, calibrator)
    score = None
    if scored:
        progress.stage("scoring on held-out presses", 0.6)
        score = cross_validate(
            ground_truth.surfaces, ground_truth.without, undeformed, fit, progress=progress
        )
    progress.stage("fitting", 0.15)
    fitted = fit([*(surface.training() for surface in good), *ground_truth.undeformed], undeformed)
    artefacts: dict[str, Artefact] = {LIGHT: fitted}
    if score is not None and score.errors is not None:
        artefacts[ERRORS] = score.errors
    progress.fraction(1.0)
    azimuths = channel_azimuths(good, undeformed)
    if is_sequential(frames[0]):
        notes = (*notes, *misplaced_lights(base, undeformed.channels, azimuths))
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
        ball_diameters_mm=ground_truth.ball_diameters_mm,
        presses_used=len(good),
        held_out=None if score is None else score.summary(),
        versions=_versions(),
        profile_hash=profile_hash(base),
    )
    notes = (*notes, *implausible(ground_truth.surfaces, undeformed, base.gel))
    if scored:
        notes = (*notes, *doubts(score, good))
    bundle = Bundle(manifest, artefacts, undeformed)
    given = inputs_of(profile, presses, reference, labels, target)
    surfaces = tuple(ground_truth.surfaces)
    return Calibrated(bundle, surfaces, score, notes + stand_in, ground_truth.basis, given)


def inputs_of(
    profile: Profile | str | Path,
    presses: Path,
    reference: Path | None,
    labels: Path | None,
    target: Path | None,
) -> Inputs:
    """Return the files that a calibration reads, which its bundle must not overwrite."""
    return Inputs.of(
        {
            PROFILE: None if isinstance(profile, Profile) else profile,
            "--presses": presses,
            "--reference": reference,
            "--labels": labels,
            "--target": target,
        }
    )


def _versions() -> dict[str, str]:
    import cv2

    return {
        "tactile-core": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
    }
