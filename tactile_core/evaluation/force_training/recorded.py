"""Samples from a recording and a table of forces."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError
from tactile_core.evaluation.force_training.samples import UnitSamples, sample_size
from tactile_core.formats.force_table import read_forces
from tactile_core.formats.printable import shown
from tactile_core.interfaces.progress import Progress
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.model import Profile

_FEWEST_SEQUENCES = 3  # One to train on, one for the standard deviations, and one for the score
_PARTS = 5  # Of a recording without named sequences


def recorded_samples(
    profile: Profile, input: Path, forces: Path, reference: Path | str | None, progress: Progress
) -> dict[str, UnitSamples]:
    """Return the labelled frames of a recording, by sequence.

    Without at least three names in the column ``sequence``, the recording is divided into five
    parts of equal length.

    Raises
    ------
    InputError
        Frames and forces do not match, a component is missing, or there is no reference.
    """
    table = read_forces(forces)
    if table.key == "time_s" or not np.isfinite(table.forces).all():
        raise InputError(
            f"{forces}: training needs all of fx_n, fy_n, fz_n and tz_nmm in each line, and "
            f"'frame' or 'file'"
        )
    if len(table.rows) < _PARTS:
        raise InputError(
            f"{forces} has {len(table.rows)} forces; give at least {_PARTS}, since some are held "
            f"out"
        )
    row_of = {name: row for row, name in enumerate(table.rows)}
    size = sample_size(profile)
    plain = profile.model_copy(update={"estimators": {}})
    images: list[Float32] = []
    rows: list[int] = []
    with open_sensor(plain, input=input, reference=reference) as sensor:
        undeformed = sensor.pipeline.reference
        if undeformed is None:
            raise InputError(
                "training needs the undeformed sensor; give --reference, a recording of it"
            )
        base = _small(undeformed.pixels, size)
        for reading in sensor.stream():
            frame = reading.frame
            row = row_of.get(table.name_of(frame.sequence, reading.source))
            if row is not None:
                images.append(_small(frame.pixels, size))
                rows.append(row)
                progress.fraction(len(rows) / len(table.rows))
    absent = sorted(set(range(len(table.rows))) - set(rows))
    if absent:
        raise InputError(
            f"{forces} has a force for the {table.key} {shown(table.rows[absent[0]])}, which "
            f"{input} does not contain; give the forces of this recording"
        )
    sequences = np.array([table.sequences[row] for row in rows])
    if len(set(sequences)) < _FEWEST_SEQUENCES:
        count = len(rows)
        sequences = np.array([f"part {1 + _PARTS * k // count}" for k in range(count)])
    stack = np.stack(images).astype(np.float16)
    modulus = profile.gel.shear_modulus_mpa or 1.0
    nothing = np.zeros(len(rows))
    whole = UnitSamples(stack, base, table.forces[rows], modulus, sequences, nothing)
    return {str(name): whole.part(sequences == name) for name in np.unique(sequences)}


def _small(pixels: Float32, size: tuple[int, int]) -> Float32:
    small = cv2.resize(np.asarray(pixels, np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32).reshape(size[1], size[0], -1)
