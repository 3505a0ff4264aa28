"""Frames beside the forces that were measured with them, in sequences for the score."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.force.cell_axes import (
    at_rest,
    is_clipped,
    rest_offset,
    runs_between_rests,
)
from tactile_core.algorithms.force.clock_offset import ClockOffset, clock_offset
from tactile_core.calibration.force.recorded_features import RecordedFeatures
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.labels import ForceTable
from tactile_core.formats.text import printable
from tactile_core.interfaces.estimator import COMPONENTS, ForceSamples


class Labelled(NamedTuple):
    """Frames with forces.

    Attributes
    ----------
    sequences : tuple of ForceSamples
    offsets : dict of str to ClockOffset
        Of the recordings whose forces have a clock of their own.
    """

    sequences: tuple[ForceSamples, ...]
    offsets: dict[str, ClockOffset]


def label_frames(
    recordings: Sequence[RecordedFeatures],
    tables: Sequence[ForceTable],
    *,
    weights: bool = False,
    fewest: int = 2,
) -> Labelled:
    """Give each frame its force.

    Several recordings are one sequence each. A single one is divided where the force comes to rest
    between presses. With known weights, each mass is a sequence.

    Parameters
    ----------
    recordings : sequence of RecordedFeatures
    tables : sequence of ForceTable
        One per recording, or one with the files of all.
    weights : bool
    fewest : int
        Number of sequences that the model needs.

    Raises
    ------
    InputError
        The forces do not belong to the frames, or the load cell was clipped or not zeroed.
    CalibrationError
        There are fewer sequences than that, or of two or more the force is constant.
    """
    if len(tables) not in (1, len(recordings)):
        raise InputError(
            f"{len(tables)} files of forces for {len(recordings)} recordings; give one for each, "
            f"in the same order, or a folder with NAME.csv for each"
        )
    if len(tables) == 1 and len(recordings) > 1 and tables[0].key != "file":
        raise InputError(
            f"{tables[0].path} names its rows by {tables[0].key!r}, which does not say which of "
            f"the {len(recordings)} recordings they belong to; give one file for each"
        )
    shared = tables[0] if len(tables) == 1 and len(recordings) > 1 else None
    matched: set[int] = set()
    sequences, offsets = list[ForceSamples](), dict[str, ClockOffset]()
    for index, recording in enumerate(recordings):
        table = shared or tables[index]
        if table.key == "time_s":
            forces, offset = _by_time(recording, table)
            offsets[recording.name] = offset
        else:
            forces, rows = _by_name(recording, table)
            matched = matched | rows if shared else rows
            if not shared:
                _refuse_unmatched(table, matched, recording.name)
        known = np.asarray(np.isfinite(forces).any(1))
        if not weights:
            _refuse_clipped(forces, table.path)
        samples = ForceSamples(recording.name, recording.features[known], forces[known])
        sequences += _divide_samples(samples, alone=len(recordings) == 1, weights=weights)
    if shared:
        _refuse_unmatched(shared, matched, "the recordings")
    sequences = [one for one in sequences if len(one.forces)]
    if sequences and not weights:
        _refuse_offset(sequences, tables[0].path)
    _refuse_few(sequences, fewest)
    return Labelled(tuple(sequences), offsets)


def _by_name(recording: RecordedFeatures, table: ForceTable) -> tuple[Float64, set[int]]:
    at = {name: row for row, name in enumerate(table.rows)}
    frames = zip(recording.numbers, recording.sources, strict=True)
    rows = [at.get(table.name_of(number, source)) for number, source in frames]
    if table.key == "file" and recording.name in at:
        rows = [at[recording.name] if row is None else row for row in rows]
    forces = np.full((len(rows), 4), np.nan)
    for frame, row in enumerate(rows):
        if row is not None:
            forces[frame] = table.forces[row]
    return forces, {row for row in rows if row is not None}


def _by_time(recording: RecordedFeatures, table: ForceTable) -> tuple[Float64, ClockOffset]:
    component = int(np.nanargmax(_spans(table.forces)))
    force = table.forces[:, component]
    known = np.isfinite(force)
    used = np.isfinite(recording.features).all(0)
    offset = clock_offset(
        recording.times_s, recording.features[:, used], table.times_s[known], force[known]
    )
    if not offset.found:
        raise InputError(
            f"{table.path}: at no time offset does the force follow what the sensor measures in "
            f"{printable(recording.name)}; check that they belong together"
        )
    at_s = recording.times_s + offset.offset_s
    outside = (at_s < table.times_s[0]) | (at_s > table.times_s[-1])
    forces = np.full((len(at_s), 4), np.nan)
    for column in range(4):
        known = np.isfinite(table.forces[:, column])
        if known.any():
            forces[:, column] = np.interp(at_s, table.times_s[known], table.forces[known, column])
    forces[outside] = np.nan
    return forces, offset


def _divide_samples(samples: ForceSamples, *, alone: bool, weights: bool) -> list[ForceSamples]:
    if weights:
        runs = np.unique(samples.forces[:, 2], return_inverse=True)[1]
    elif alone and len(samples.forces):
        runs = runs_between_rests(_size(samples.forces))
    else:
        return [samples]
    return [
        ForceSamples(
            f"{samples.name} {run + 1}", samples.features[runs == run], samples.forces[runs == run]
        )
        for run in np.unique(runs)
    ]


def _size(forces: Float64) -> Float64:
    """(N,) size of the force, or of the torque if no force was measured."""
    shown = forces[:, :3] if np.isfinite(forces[:, :3]).any() else forces[:, 3:]
    return np.asarray(np.sqrt(np.nansum(shown**2, axis=1)))


def _refuse_unmatched(table: ForceTable, matched: set[int], where: str) -> None:
    missing = [name for row, name in enumerate(table.rows) if row not in matched]
    if missing:
        what = "frame" if table.key == "frame" else "file"
        raise InputError(
            f"{table.path}: {len(missing)} of {len(table.rows)} lines name a {what} that "
            f"{printable(where)} does not have, such as {printable(missing[0])}; give the forces "
            f"of this recording"
        )


def _refuse_clipped(forces: Float64, path: Path) -> None:
    for component, name in enumerate(COMPONENTS):
        force = forces[:, component]
        if is_clipped(force):
            raise InputError(
                f"{path}: {name} stays at its extreme, {_extreme(force):.4g}, for several "
                f"readings: the load cell is clipped; press less, or leave those lines out"
            )


def _refuse_offset(sequences: Sequence[ForceSamples], path: Path) -> None:
    features = np.concatenate([one.features for one in sequences])
    forces = np.concatenate([one.forces for one in sequences])
    known = np.isfinite(features).all(0)
    if not known.any():
        return
    still = at_rest(features[:, known])
    for component, name in enumerate(COMPONENTS):
        offset = rest_offset(forces[:, component], still)
        if offset:
            raise InputError(
                f"{path}: {name} is {offset:.3g} where nothing touches the sensor: the load cell "
                f"was not zeroed; subtract this from the column"
            )


def _refuse_few(sequences: Sequence[ForceSamples], fewest: int) -> None:
    if len(sequences) >= fewest == 1:  # what is fitted is known roughly before
        return
    if len(sequences) < 2:
        raise CalibrationError(
            "one sequence is too few: the score needs one that the model was not fitted on; give "
            "several recordings, or one with several presses and no load between them"
        )
    forces = np.concatenate([one.forces for one in sequences])
    spans = _spans(forces)
    constant = [name for name, span in zip(COMPONENTS, spans, strict=True) if span == 0]
    if constant:
        raise CalibrationError(
            f"{constant[0]} is the same in every frame, so nothing can be fitted to it; press with "
            f"different forces, or leave the column out"
        )


def _spans(forces: Float64) -> Float64:
    """(4,) range of each component; NaN if it was not measured."""
    known = np.isfinite(forces).any(0)
    spans = np.full(4, np.nan)
    spans[known] = np.nanmax(forces[:, known], 0) - np.nanmin(forces[:, known], 0)
    return spans


def _extreme(force: Float64) -> float:
    return float(force[np.nanargmax(np.abs(force - np.nanmedian(force)))])
