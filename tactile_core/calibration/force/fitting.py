"""Fits forces to labelled recordings, whose clock may be another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactile_core.acquisition.devices import images_per_observation
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.force.cell_axes import (
    CellRotation,
    ToolOffset,
    about_centre,
    cell_rotation,
    tool_offset,
)
from tactile_core.bundles.bundle import Bundle, manifest_for, names_of
from tactile_core.bundles.places import default_place
from tactile_core.calibration.force.labelled import label_frames
from tactile_core.calibration.force.recorded_features import (
    MeasuredRecordings,
    measured_recordings,
)
from tactile_core.calibration.force.result import (
    ComponentScore,
    ForceCalibrated,
    held_out_forces,
    score_forces,
)
from tactile_core.errors import InputError
from tactile_core.formats.labels import ForceTable, read_forces, read_weights
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.interfaces.estimator import FittedForce, ForceModel, ForceSamples
from tactile_core.plugins.blame import blame, fault
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.recordings.recovery import NamedRecording, list_recordings


class Alignment(NamedTuple):
    """Where the load cell is, as far as the forces determine it.

    Attributes
    ----------
    rotation : CellRotation or None
    offset : ToolOffset or None
    sequences : tuple of ForceSamples
        With forces in the image's axes, and torque about the image centre if the offset is
        determined.
    """

    rotation: CellRotation | None
    offset: ToolOffset | None
    sequences: tuple[ForceSamples, ...]


def align_forces(sequences: Sequence[ForceSamples], names: Sequence[str]) -> Alignment:
    """Find the load cell's axes and position, and convert its forces.

    Parameters
    ----------
    sequences : sequence of ForceSamples
    names : sequence of str
        Names of the features; see
        :attr:`~tactile_core.interfaces.estimator.FittedForce.feature_names`.
    """
    forces = np.concatenate([one.forces for one in sequences])
    features = np.concatenate([one.features for one in sequences])
    column = {name: features[:, index] for index, name in enumerate(names)}
    shift = [column.get(name) for name in ("shift_x", "shift_y")]
    known = np.isfinite(forces[:, :2]).all(1)
    if not known.any() or any(one is None or not np.isfinite(one).all() for one in shift):
        return Alignment(None, None, tuple(sequences))
    normal = np.nan_to_num(forces[known, 2])
    rotation = cell_rotation(np.stack(shift, 1)[known], forces[known, :2], normal)  # type: ignore[arg-type]
    if rotation is not None:
        forces = forces.copy()
        forces[:, :2] = forces[:, :2] @ rotation.matrix.T
        forces[:, 3] *= -1 if rotation.mirrored else 1
    known &= np.isfinite(forces).all(1)
    offset = None
    if "moment" in column and known.any():
        offset = tool_offset(column["moment"][known], forces[known])
        if offset is not None and offset.determined:
            forces = about_centre(forces, offset)
    return Alignment(rotation, offset, _replace_forces(sequences, forces))


def _replace_forces(sequences: Sequence[ForceSamples], forces: Float64) -> tuple[ForceSamples, ...]:
    ends = np.cumsum([len(one.forces) for one in sequences])
    parts = np.split(forces, ends[:-1])
    return tuple(replace(one, forces=part) for one, part in zip(sequences, parts, strict=True))


_CALIBRATION = "the force calibration"


def calibrate_force(
    profile: Profile | str | Path,
    inputs: Sequence[Path],
    forces: Sequence[Path] = (),
    *,
    weights: Path | None = None,
    bundle: Path | None = None,
    reference: Path | str | None = None,
    serial: str | None = None,
    step: str | None = None,
    align: bool = False,
    progress: Progress | None = None,
) -> ForceCalibrated:
    """Fit a force step to recordings and measured forces, and score it on held-out sequences.

    Parameters
    ----------
    profile : Profile, str or Path
    inputs : sequence of Path
        Recordings, or folders of recordings.
    forces : sequence of Path
        CSV files, one per recording in the same order, one with the files of all, or one folder
        with NAME.csv for each recording.
    weights : Path, optional
        CSV ``file,mass_g`` instead of forces: masses that were laid on the sensor.
    bundle : Path, optional
        The unit's bundle, to which the model is added. Default: that in the user's data directory;
        without one, the new bundle holds the force model alone.
    reference : Path or "first", optional
        The undeformed sensor. Default: the bundle's.
    serial : str, optional
    step : str, optional
        Name of the step. Default: the only one that can be fitted.
    align : bool
        Turn the forces into the image's axes, and their torque to the image centre.
    progress : Progress, optional

    Raises
    ------
    InputError
        The forces do not belong to the recordings, or the load cell was clipped or not zeroed; or
        the profile has no step that can be fitted.
    CalibrationError
        The sequences do not determine the model.
    """
    progress = progress or Silent()
    known = profile if isinstance(profile, Profile) else load_profile(profile)
    recordings = list_recordings(inputs, images_per_observation=images_per_observation(known))
    tables = _tables(recordings, forces, weights)
    measured = measured_recordings(
        known,
        recordings,
        bundle=bundle,
        reference=reference,
        serial=serial,
        step=step,
        progress=progress,
    )
    fewest = measured.estimator.fewest_sequences
    found = label_frames(measured.recordings, tables, weights=weights is not None, fewest=fewest)
    names = measured.estimator.feature_names
    alignment = align_forces(found.sequences, names)
    sequences = alignment.sequences if align else found.sequences
    fit = partial(_fit_model, measured.estimator)
    progress.stage("scoring on held-out sequences", 0.1)
    scores = score_forces(sequences, *held_out_forces(sequences, fit, progress), names)
    place = bundle if bundle is not None else default_place(known, serial)
    return ForceCalibrated(
        _with_model(known, measured, fit(sequences), serial),
        measured.step.name,
        len(sequences),
        sum(len(one.forces) for one in sequences),
        scores,
        found.offsets,
        alignment.rotation,
        alignment.offset,
        align,
        (*measured.notes, *_doubts(scores)),
        place if measured.bundle is not None and place.is_dir() else None,
    )


def _doubts(scores: Mapping[str, ComponentScore]) -> Iterator[str]:
    for name, score in scores.items():
        if score.r2 < 0:
            yield (
                f"held-out {name} is predicted worse than by its mean (R² {score.r2:.2f}); check "
                f"that the forces belong to the images, and press with more different ones"
            )


def _tables(
    recordings: Sequence[NamedRecording], forces: Sequence[Path], weights: Path | None
) -> list[ForceTable]:
    if (weights is None) == (not forces):
        raise InputError("give either --forces, measured forces, or --weights, known masses")
    if weights is not None:
        return [read_weights(weights)]
    if len(forces) == 1 and forces[0].is_dir():
        files = [forces[0] / f"{one.name}.csv" for one in recordings]
        missing = next((path for path in files if not path.is_file()), None)
        if missing is not None:
            raise InputError(
                f"{forces[0]} has no {missing.name}; each recording needs its forces, with the "
                f"same name"
            )
        return [read_forces(path) for path in files]
    return [read_forces(path) for path in forces]


def _fit_model(estimator: FittedForce, sequences: Sequence[ForceSamples]) -> ForceModel:
    with blame(_CALIBRATION, estimator):
        model = estimator.fit(sequences)
    if not isinstance(model, ForceModel):
        raise fault(_CALIBRATION, estimator, f"fitted {type(model).__name__}, not a ForceModel")
    return model


def _with_model(
    profile: Profile, measured: MeasuredRecordings, model: ForceModel, serial: str | None
) -> Bundle:
    name = measured.estimator.artefact
    older = measured.bundle
    before: dict[str, Artefact] = {} if older is None else dict(older.artefacts)
    artefacts = {**before, name: model}
    if older is not None:
        manifest = older.manifest.model_copy(update={"artefacts": names_of(artefacts)})
        return Bundle(manifest, artefacts, older.reference or measured.reference)
    reference = measured.reference
    manifest = manifest_for(profile, reference.channels, artefacts, serial=serial or "")
    return Bundle(manifest, artefacts, reference)
