"""The features of a force step in every frame of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import InputError
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.calibration import Progress
from tactile_core.interfaces.estimator import FittedForce
from tactile_core.pipeline.chain import Step
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.recovery import NamedRecording


@dataclass(frozen=True, eq=False)
class RecordedFeatures:
    """What one recording gives to the fit.

    Attributes
    ----------
    name : str
    numbers : tuple of int
        Sequence number of each frame.
    sources : tuple of str
        Name of each frame's file.
    times_s : (N,) float64
    features : (N, K) float64
    """

    name: str
    numbers: tuple[int, ...]
    sources: tuple[str, ...]
    times_s: Float64
    features: Float64


@dataclass(frozen=True, eq=False)
class MeasuredRecordings:
    """All recordings, measured.

    Attributes
    ----------
    step : Step
        The step that is fitted.
    recordings : tuple of RecordedFeatures
    bundle : Bundle or None
        What the recordings were measured with.
    reference : Reference
    notes : tuple of str
    """

    step: Step
    recordings: tuple[RecordedFeatures, ...]
    bundle: Bundle | None
    reference: Reference
    notes: tuple[str, ...]

    @property
    def estimator(self) -> FittedForce:
        """The step's estimator."""
        assert isinstance(self.step.estimator, FittedForce)
        return self.step.estimator


def measured_recordings(
    profile: Profile,
    recordings: tuple[NamedRecording, ...],
    *,
    bundle: Bundle | Path | None,
    reference: Path | str | None,
    serial: str | None,
    step: str | None,
    progress: Progress,
) -> MeasuredRecordings:
    """Run the chain on every recording and keep the features of its force step.

    Raises
    ------
    InputError
        The profile has no step that can be fitted, or there is no reference.
    """
    found: list[RecordedFeatures] = []
    notes: dict[str, None] = {}
    fitted, used, undeformed = None, None, None
    for one in recordings:
        progress.stage(f"measuring {one.name}", 0.9 / len(recordings))
        with open_sensor(
            profile, bundle=bundle, input=one.path, reference=reference, serial=serial
        ) as sensor:
            pipeline = sensor.pipeline
            fitted, used = fitted_step(pipeline, step), pipeline.bundle
            if pipeline.reference is None:
                raise InputError(
                    "force is measured relative to the undeformed sensor; give --reference, or "
                    "--reference first if the first frame shows no contact"
                )
            undeformed = undeformed or pipeline.reference
            notes |= dict.fromkeys(note for note in sensor.notes if "calibrate-force" not in note)
            estimator = fitted.estimator
            assert isinstance(estimator, FittedForce)
            rows: list[tuple[int, str, float, Float64]] = []
            kinds = [kind for kind in fitted.takes if not issubclass(kind, Artefact)]
            for reading in sensor.stream():
                frame = reading.frame
                given = {**reading.inputs, **reading.quantities, Frame: frame}
                given[Reference] = pipeline.reference
                with fitted.blame_step():
                    found_here = estimator.features(*(given.get(kind) for kind in kinds))
                features = np.asarray(found_here, np.float64)
                rows.append((frame.sequence, reading.source, frame.timestamp_s, features))
                progress.fraction(len(rows) / (sensor.observations or len(rows)))
        if not rows:
            raise InputError(f"{one.path} has no frame")
        numbers, sources, times_s, features_of = zip(*rows, strict=True)
        found.append(
            RecordedFeatures(one.name, numbers, sources, np.array(times_s), np.stack(features_of))
        )
    assert fitted is not None
    assert undeformed is not None
    return MeasuredRecordings(fitted, tuple(found), used, undeformed, tuple(notes))


def fitted_step(pipeline: Pipeline, name: str | None) -> Step:
    """Return the step of a chain that can be fitted to forces.

    Raises
    ------
    InputError
        There is none, none with this name, or there are several and none is named.
    """
    steps = [step for step in pipeline.steps if isinstance(step.estimator, FittedForce)]
    if name is not None:
        steps = [step for step in steps if step.name == name]
    if len(steps) == 1:
        return steps[0]
    if steps:
        names = ", ".join(step.name for step in steps)
        raise InputError(f"the profile has several steps that can be fitted: {names}; give --step")
    which = "no step" if name is None else f"no step {name!r}"
    raise InputError(
        f"{pipeline.profile.name} has {which} that can be fitted to forces; add "
        f"'force: {{use: core.force_linear}}' to its estimators"
    )
