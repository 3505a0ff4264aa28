"""Calibrate one physical unit: locate the target, fit, cross-validate, bundle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tactile_core.bundles.places import check_serial
from tactile_core.calibration.crew import Crew
from tactile_core.calibration.fitted_bundle import GuidedSession, conditioning_for, fitted_bundle
from tactile_core.calibration.press_search import check_ball
from tactile_core.calibration.result import Calibrated
from tactile_core.calibration.target_surface import is_height_map
from tactile_core.calibration.targets import (
    CalibrationTarget,
    balls,
    rows_of_map,
    separate_balls,
    undeformed_sensor,
)
from tactile_core.errors import InputError
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.pipeline.initial_reference import reference_path
from tactile_core.pipeline.playback import played_back, read_frames, recorded_session
from tactile_core.plugins.options import fittable_calibrator, smoothing_px_of
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.inputs import PROFILE, Inputs
from tactile_core.recordings.session_files import taken_reference

# [count] Fewest presses that several processes share. With fewer, starting a process takes longer
# than it saves (ADR 8)
_FEWEST_SHARED = 12


def calibrate(
    profile: Profile | str | Path,
    presses: Path,
    reference: Path | str | None = None,
    *,
    ball_diameter_mm: float | None = None,
    labels: Path | None = None,
    target: Path | None = None,
    rows: slice | None = None,
    model: str | None = None,
    serial: str = "",
    gel: str = "",
    scored: bool = True,
    progress: Progress | None = None,
    workers: int = 1,
) -> Calibrated:
    """Fit and score a calibration from presses of a ball or of another calibration target.

    Parameters
    ----------
    profile : Profile, str or Path
    presses : Path
        A recording of the ball, pressed somewhere else in each observation, or of a guided
        calibration. With a target: a recording of the single observation that shows it.
    reference : Path or "median", optional
        A recording of the undeformed sensor. ``"median"`` takes the median of the presses, which
        says how far to trust it. Default: the reference in the recording of the presses, if a
        sensor recorded one. A height map as target does not need it: without a
        reference, or if the reference is the press itself, the large-scale light of the press is
        used.
    ball_diameter_mm : float, optional
        Diameter of the ball in all presses that no ``catalog.csv`` in their folder lists. A
        ``target`` brings its own radius, a guided calibration its ball.
    labels : Path, optional
        Circles that replace the automatic ones: a CSV, or a folder; see
        :func:`~tactile_core.formats.labels.read_labels`.
    target : Path, optional
        A grid of balls (YAML with ``radius`` and circle centres) or a height map (``.tmd``) of the
        surface in the press.
    rows : slice, optional
        Rows of the height map to use.
    model : str, optional
        ``plugin.name`` of a calibrator that replaces the profile's.
    serial : str
        Serial of the physical unit.
    gel : str
        Name of the gel on the unit: gels wear and are changed, and each needs its calibration.
    scored : bool
        False skips the cross-validation, which takes several times as long as the fit.
    progress : Progress, optional
    workers : int
        Number of processes that share the work, this one included. A few presses are too little
        work for more than one. The result is the same.

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
    if gel:
        check_serial(gel, "gel")
    if rows is not None and not is_height_map(target):
        raise InputError("--rows chooses rows of a height map; give it as --target, a .tmd file")
    session = recorded_session(presses)
    virtual = session is not None and session.sim
    base = profile if isinstance(profile, Profile) else load_profile(profile, sim=virtual)
    base, notes, _, _ = played_back(base, presses)
    calibrator = fittable_calibrator(base.calibration, model)
    guided = GuidedSession.from_recording(presses)
    if guided is not None and ball_diameter_mm is None:
        ball_diameter_mm = guided.ball_diameter_mm
    if ball_diameter_mm is not None:
        check_ball(ball_diameter_mm, base)
    # one at a time: a recorded session has thousands of frames besides its presses
    frames = [
        frame for frame in read_frames(base, presses) if guided is None or guided.is_kept(frame)
    ]
    if guided is not None and not frames:
        raise InputError(
            f"{presses} holds a guided calibration without any press that was kept; record again"
        )
    helpers = workers - 1 if scored and len(frames) >= _FEWEST_SHARED else 0
    own = None if session is None or reference else taken_reference(session, presses)
    undeformed, stand_in = undeformed_sensor(base, frames, reference, target, own)
    condition = conditioning_for(base, undeformed, calibrator)
    undeformed = condition.undeformed
    # Models smooth their images; the ground truth has to be equally smooth.
    blur_px = smoothing_px_of(calibrator, base.image.mm_per_px)
    with Crew(helpers, modules=[fitted_bundle.__module__]) as crew:
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
                crew=crew,
            )
        )
        made = fitted_bundle(
            base,
            ground_truth,
            undeformed,
            calibrator,
            serial=serial,
            gel=gel,
            scored=scored,
            notes=notes,
            progress=progress,
            crew=crew,
        )
    given = inputs_of(profile, presses, reference, labels, target)
    return replace(made, notes=made.notes + stand_in, inputs=given)


def calibrate_presses(
    profile: Profile,
    presses: Mapping[str, Frame],
    reference: Reference,
    *,
    ball_diameter_mm: float,
    model: str | None = None,
    serial: str = "",
    gel: str = "",
    scored: bool = True,
    progress: Progress | None = None,
) -> Calibrated:
    """Fit and score a calibration from frames of a ball, as :func:`calibrate` does from files.

    Parameters
    ----------
    profile : Profile
    presses : mapping of str to Frame
        One press each, by the name that reports use; as acquired, not conditioned.
    reference : Reference
        The undeformed sensor, as averaged, without masks.
    ball_diameter_mm : float
    model, serial, gel, scored
        As in :func:`calibrate`.

    Raises
    ------
    InputError, ProfileError, CalibrationError
        As :func:`calibrate`.
    """
    progress = progress or Silent()
    check_ball(ball_diameter_mm, profile)
    calibrator = fittable_calibrator(profile.calibration, model)
    condition = conditioning_for(profile, reference, calibrator)
    ground_truth = separate_balls(
        profile,
        list(presses),
        list(presses.values()),
        condition,
        [ball_diameter_mm] * len(presses),
        for_heights=calibrator.fits == "heights",
        progress=progress,
    )
    return fitted_bundle(
        profile,
        ground_truth,
        condition.undeformed,
        calibrator,
        serial=serial,
        gel=gel,
        scored=scored,
        progress=progress,
    )


def inputs_of(
    profile: Profile | str | Path,
    presses: Path | None,
    reference: Path | str | None,
    labels: Path | None,
    target: Path | None,
) -> Inputs:
    """Return the files that a calibration reads, which its bundle must not overwrite."""
    return Inputs.from_paths(
        {
            PROFILE: None if isinstance(profile, Profile) else profile,
            "--presses": presses,
            "--reference": reference_path(reference),
            "--labels": labels,
            "--target": target,
        }
    )
