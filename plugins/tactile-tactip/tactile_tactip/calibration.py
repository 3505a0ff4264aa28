"""Fits distance and angle of a surface to labelled presses, and scores the fit on others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.bundles.bundle import Bundle, manifest_for
from tactile_core.errors import CalibrationError, InputError
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.quantities import MarkerField
from tactile_tactip.labels import Labels
from tactile_tactip.surface import LEAST_SEEN, SurfaceModel, moved_pins

ARTEFACT = "surface"  # Name of the model in a bundle
_SPLITS = 10  # [count] Random divisions of the presses; the score differs between them
_NAMES = (("distance", "mm"), ("angle", "deg"))


class Score(NamedTuple):
    """Errors on presses that were held out, over all splits.

    Attributes
    ----------
    rms, mae : float
        Root mean square and mean of the size of the errors, mm or degrees.
    rms_low, rms_high : float
        Smallest and largest RMS of a split.
    within_1_std, within_2_std : float
        Share of the errors within one and within two standard deviations; 0.68 and 0.95 if those
        are right.
    """

    rms: float
    mae: float
    rms_low: float
    rms_high: float
    within_1_std: float
    within_2_std: float


@dataclass(frozen=True, eq=False)
class SurfaceCalibrated:
    """A bundle with a surface model, ready to save.

    Attributes
    ----------
    bundle : Bundle
    presses : int
    scores : dict of str to Score
        Of ``distance`` in mm and of ``angle`` in degrees.
    notes : tuple of str
    """

    bundle: Bundle
    presses: int
    scores: dict[str, Score]
    notes: tuple[str, ...]

    def summary(self, directory: Path) -> dict[str, Any]:
        """Return the object that ``tactile calibrate-surface --json`` prints."""
        held_out = {name: score._asdict() for name, score in self.scores.items()}
        return {"bundle": str(directory), "presses": self.presses, "held_out": held_out}

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Return header and rows of the table that the command prints."""
        header = ["held out", "RMS", "of splits", "mean error", "within 1 σ", "within 2 σ"]
        rows = [
            [
                name,
                f"{score.rms:.3f} {unit}",
                f"{score.rms_low:.3f}–{score.rms_high:.3f}",
                f"{score.mae:.3f} {unit}",
                f"{score.within_1_std:.0%}",
                f"{score.within_2_std:.0%}",
            ]
            for (name, unit), score in zip(_NAMES, self.scores.values(), strict=True)
        ]
        return header, rows


def calibrate_surface(
    profile: str | Path,
    recording: Path,
    labels: Labels,
    *,
    reference: Path | str | None = None,
    serial: str | None = None,
    progress: Progress | None = None,
) -> SurfaceCalibrated:
    """Fit a surface model to a recording whose frames are labelled presses on a flat surface.

    Parameters
    ----------
    profile : str or Path
    recording : Path
    labels : Labels
        One for each frame.
    reference : Path or "first", optional
        The sensor without contact. Default: that of the recording, if a sensor wrote it.
    serial : str, optional
    progress : Progress, optional

    Raises
    ------
    InputError
        Frames and labels do not match, a frame is not of this sensor, or there is no reference.
    CalibrationError
        The presses do not determine the model.
    """
    progress = progress or Silent()
    progress.stage("finding the pins", 0.5)
    with open_sensor(
        profile, bundle=None, input=recording, reference=reference, serial=serial
    ) as sensor:
        undeformed = sensor.pipeline.reference
        if undeformed is None:
            raise InputError(
                "pins move from where they are without contact; give --reference, a frame "
                "without contact"
            )
        notes = tuple(note for note in sensor.notes if SurfaceModel.command not in note)
        sources, pins = _pins(sensor, progress)
        name, channels = sensor.profile, undeformed.channels
    poses = labels.of_frames(sources, recording)
    pins_px = pins[0].reference_px.astype(np.float64)
    moved_px = np.stack([moved_pins(one) for one in pins])
    model = SurfaceModel.fit(pins_px, moved_px, poses)
    progress.stage("scoring on held-out presses", 0.5)
    scores = score_splits(pins_px, moved_px, poses, progress)
    artefacts = {ARTEFACT: model}
    manifest = manifest_for(name, channels, artefacts, serial=serial or "")
    return SurfaceCalibrated(Bundle(manifest, artefacts, undeformed), len(poses), scores, notes)


def _pins(sensor: Sensor, progress: Progress) -> tuple[list[str], list[MarkerField]]:
    sources: list[str] = []
    pins: list[MarkerField] = []
    for reading in sensor.stream():
        found = reading.get(MarkerField)
        if found is None:
            raise InputError(
                f"{sensor.profile.name} finds no pins; add the steps 'core.markers' and "
                f"'tactip.pins' to its estimators"
            )
        if np.count_nonzero(found.seen) < LEAST_SEEN * len(found.seen):
            raise InputError(f"{reading.source}: {found.notes[0]}")
        sources.append(reading.source)
        pins.append(found)
        progress.fraction(len(pins) / (sensor.observations or len(pins)))
    if not pins:
        raise InputError("the recording has no frame")
    return sources, pins


def score_splits(
    pins_px: Float64, moved_px: Float64, poses: Float64, progress: Progress | None = None
) -> dict[str, Score]:
    """Score models that are fitted to two thirds of the presses on the remaining third.

    Presses are independent, so that they are divided at random, the same way each time.

    Raises
    ------
    CalibrationError
        Two thirds of the presses do not determine a model.
    """
    progress = progress or Silent()
    errors, stds, rms = [], [], []
    for split in range(_SPLITS):
        order = np.random.default_rng(split).permutation(len(poses))
        held_out, used = np.split(order, [len(order) // 3])
        try:
            model = SurfaceModel.fit(pins_px, moved_px[used], poses[used])
        except CalibrationError as why:
            raise CalibrationError(f"two thirds of the presses, for the score: {why}") from why
        found, std = model.poses(moved_px[held_out])
        errors.append(found - poses[held_out])
        stds.append(std)
        rms.append(np.sqrt((errors[-1] ** 2).mean(axis=0)))
        progress.fraction((split + 1) / _SPLITS)
    error, std = np.concatenate(errors), np.concatenate(stds)
    each = np.stack(rms)
    size = np.abs(error)
    return {
        name: Score(
            float(np.sqrt((error[:, n] ** 2).mean())),
            float(size[:, n].mean()),
            float(each[:, n].min()),
            float(each[:, n].max()),
            float((size[:, n] <= std[:, n]).mean()),
            float((size[:, n] <= 2 * std[:, n]).mean()),
        )
        for n, (name, _) in enumerate(_NAMES)
    }
