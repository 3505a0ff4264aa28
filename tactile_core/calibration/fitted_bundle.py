"""The bundle of a fitted calibration."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from tactile_core.bundles.bundle import Bundle, manifest_for
from tactile_core.bundles.manifest import ERRORS, LIGHT
from tactile_core.calibration.crew import ALONE, Crew, Task
from tactile_core.calibration.doubts import doubts, implausible
from tactile_core.calibration.light_range import (
    channel_azimuths,
    light_range,
    misplaced_lights,
    thickness_of,
)
from tactile_core.calibration.result import Calibrated
from tactile_core.calibration.scoring import CrossValidation, Trials
from tactile_core.calibration.targets import CalibrationTarget
from tactile_core.conditioning.conditioning import Conditioning, is_sequential
from tactile_core.errors import InputError
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.calibration import Calibration, Calibrator, Progress
from tactile_core.interfaces.recording_format import EventEntry
from tactile_core.plugins.options import fitted_by
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.source import is_recorded, recording_file


def conditioning_for(
    profile: Profile, reference: Reference, calibrator: Calibrator | Calibration
) -> Conditioning:
    """Return the conditioning of the frames that a calibrator is fitted on, or a model measures.

    Raises
    ------
    InputError
        The markers of the reference contradict the profile.
    """
    compensates = calibrator.compensation == "channel"
    condition = Conditioning.for_build(profile, reference, compensates=compensates)
    miscounted = condition.finder.explain_miscount(condition.undeformed) if condition.finder else ""
    if miscounted:
        raise InputError(miscounted)
    return condition


def fitted_bundle(
    profile: Profile,
    ground_truth: CalibrationTarget[Any],
    undeformed: Reference,
    calibrator: Calibrator,
    *,
    serial: str = "",
    gel: str = "",
    scored: bool = True,
    notes: tuple[str, ...] = (),
    progress: Progress,
    crew: Crew = ALONE,
) -> Calibrated:
    """Fit and score a calibrator on surfaces with ground truth.

    Parameters
    ----------
    profile : Profile
    ground_truth : CalibrationTarget
    undeformed : Reference
        Conditioned.
    calibrator : Calibrator
    serial, gel : str
    scored : bool
        False skips the cross-validation.
    notes : tuple of str
        Notes until now; others follow them.
    progress : Progress
    crew : Crew
        Processes that share the work.
    """
    surfaces = tuple(ground_truth.surfaces)
    good = [surface for surface in surfaces if surface.used]
    trials = Trials(
        surfaces,
        ground_truth.without,
        undeformed,
        partial(fitted_by, calibrator),
        thickness_of(profile),
        tuple(ground_truth.undeformed),
    )
    parts = CrossValidation.from_trials(trials) if scored else None
    tasks = [*(() if parts is None else parts.tasks), Task(Trials.fit_all, ())]
    progress.stage("fitting, and scoring on held-out presses" if scored else "fitting", 0.75)
    *results, fitted = crew.run(trials, tasks, progress.fraction)
    score = None if parts is None else parts.score(results)
    artefacts: dict[str, Artefact] = {LIGHT: fitted}
    if score is not None and score.errors is not None:
        artefacts[ERRORS] = score.errors
    azimuths = channel_azimuths(good, undeformed)
    if is_sequential(good[0].frame):
        notes = (*notes, *misplaced_lights(profile, undeformed.channels, azimuths))
    doubted = implausible(surfaces, undeformed, profile.gel)
    if scored:
        doubted = (*doubted, *doubts(score, good))
    manifest = manifest_for(
        profile,
        undeformed.channels,
        artefacts,
        serial=serial,
        gel_id=gel,
        channel_azimuth_deg=azimuths,
        ball_diameters_mm=ground_truth.ball_diameters_mm,
        presses_used=len(good),
        held_out=None if score is None else score.summary(),
        light_range=light_range(good, undeformed),
        doubts=doubted,
    )
    bundle = Bundle(manifest, artefacts, undeformed)
    return Calibrated(bundle, surfaces, score, (*notes, *doubted), ground_truth.basis)


# Names of the events; their values are those of GuidedSession.
KEPT, WITHDRAWN = "calibration press kept", "calibration press withdrawn"


@dataclass(frozen=True)
class GuidedSession:
    """Presses that a guided calibration kept.

    Attributes
    ----------
    stamps_s : frozenset of float
        Timestamps of their frames.
    ball_diameter_mm : float
    """

    stamps_s: frozenset[float]
    ball_diameter_mm: float

    @classmethod
    def from_recording(cls, path: Path) -> GuidedSession | None:
        """Read it from a recording; None if no calibration was guided in it."""
        if not path.exists() or not is_recorded(path):
            return None
        stamps: dict[str, float] = {}
        ball_mm = None
        with recording_file(path) as file:
            for entry in file.entries:
                if not isinstance(entry, EventEntry):
                    continue
                if entry.name == KEPT:
                    stamps[str(entry.values["name"])] = float(entry.values["timestamp_s"])
                    ball_mm = float(entry.values["ball_diameter_mm"])
                elif entry.name == WITHDRAWN:
                    stamps.pop(str(entry.values["name"]), None)
        return None if ball_mm is None else cls(frozenset(stamps.values()), ball_mm)

    def is_kept(self, frame: Frame) -> bool:
        """Whether a frame is one of the presses."""
        return frame.timestamp_s in self.stamps_s
