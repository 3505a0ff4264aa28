"""One recording to measure, and what came of it; both can be pickled."""

from __future__ import annotations

import json
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import Any

from tactile_core.errors import InputError, TactileError, words_of
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.pipeline.sinks import Sinks
from tactile_core.plugins.blame import blame_of
from tactile_core.profiles.model import Profile
from tactile_core.recordings.output_folder import (
    READINGS,
    OutputFolder,
    complete_results,
    report_of,
)


@dataclass(frozen=True)
class RecordingJob:
    """A recording, and how to measure it.

    Attributes
    ----------
    name : str
    recording : Path
    folder : Path or None
        Destination of the results; None if there are no files to write.
    fingerprint : str
        Of everything that the results depend on.
    profile, bundle, reference, serial, gel
        As of :func:`~tactile_core.pipeline.opening.open_sensor`.
    save : tuple of str
        Names of the sinks.
    tare_frame, frames : int or None
        Number of the frame whose load is subtracted; most frames to measure.
    """

    name: str
    recording: Path
    folder: Path | None
    fingerprint: str
    profile: Profile | str | Path
    bundle: Path | None = None
    reference: Path | str | None = None
    serial: str | None = None
    gel: str | None = None
    save: tuple[str, ...] = ()
    tare_frame: int | None = None
    frames: int | None = None


@dataclass(frozen=True)
class MeasuredRecording:
    """What came of a recording.

    Attributes
    ----------
    name : str
    recording : Path
    folder : Path or None
        The results; None if none were to be written or the recording failed.
    observations : int
        Number of readings.
    deepest_mm : float or None
        Greatest height of all readings.
    warned : int
        Number of readings with warnings.
    notes : tuple of str
        Notes about the recording as a whole.
    duration_s : float
        Time that measuring took.
    earlier : bool
        Whether an earlier run had measured it.
    failure : str
        Why it could not be measured; empty if it was.
    """

    name: str
    recording: Path
    folder: Path | None = None
    observations: int = 0
    deepest_mm: float | None = None
    warned: int = 0
    notes: tuple[str, ...] = ()
    duration_s: float = 0.0
    earlier: bool = False
    failure: str = ""
    _lines: tuple[str, ...] = ()

    def lines(self) -> Iterator[dict[str, Any]]:
        """Yield the line of ``tactile run --json`` of each reading, with the recording's name."""
        if self.folder is None:
            yield from map(json.loads, self._lines)
            return
        with (self.folder / READINGS).open(encoding="utf-8") as file:
            yield from map(json.loads, file)


def measuring(job: RecordingJob) -> Generator[float | MeasuredRecording, None, None]:
    """Measure a recording; a failure of it is part of the result.

    The results appear in the job's folder when the last reading is written.

    Parameters
    ----------
    job : RecordingJob

    Yields
    ------
    float or MeasuredRecording
        The measured share after each reading, 0..1, and last what came of the recording.
    """
    start = perf_counter()
    try:
        if job.folder is None:
            found = yield from _measuring(job, None)
        else:
            with complete_results(job.folder, job.fingerprint) as (folder, described):
                found = yield from _measuring(job, folder)
                described.update(
                    recording=str(job.recording),
                    observations=found.observations,
                    deepest_mm=found.deepest_mm,
                    warned=found.warned,
                    notes=found.notes,
                    duration_s=perf_counter() - start,
                )
            found = replace(found, folder=job.folder, _lines=())
        found = replace(found, duration_s=perf_counter() - start)
    except Exception as error:
        found = report_failure(job, error)
    yield found


def measure_recording(job: RecordingJob) -> MeasuredRecording:
    """Measure a recording as :func:`measuring` does, without reports."""
    *_, found = measuring(job)
    assert isinstance(found, MeasuredRecording)
    return found


def measured_earlier(job: RecordingJob) -> MeasuredRecording | None:
    """Return the results of an earlier run; None if there are none, or they are out of date."""
    report = None if job.folder is None else report_of(job.folder, job.fingerprint)
    if report is None:
        return None
    return MeasuredRecording(
        job.name,
        job.recording,
        job.folder,
        observations=report["observations"],
        deepest_mm=report["deepest_mm"],
        warned=report["warned"],
        notes=tuple(report["notes"]),
        duration_s=report["duration_s"],
        earlier=True,
    )


def report_failure(job: RecordingJob, error: Exception | str) -> MeasuredRecording:
    """Return the result for a recording that could not be measured."""
    return MeasuredRecording(job.name, job.recording, failure=_sentence(error))


def _sentence(error: Exception | str) -> str:
    if isinstance(error, str | TactileError):
        return str(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory for it; use fewer workers"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror} ({error.filename})" if error.filename else error.strerror
    return (
        f"{words_of(error)} (this is a bug; measure it alone with --debug, and report the output)"
    )


def _measuring(
    job: RecordingJob, folder: OutputFolder | None
) -> Generator[float, None, MeasuredRecording]:
    lines, deepest, warned, tared = [], [], 0, job.tare_frame is None
    with _open_sensor(job) as sensor:
        sinks = Sinks(sensor.profile, job.save)
        with sinks.open(sensor.pipeline, folder, sensor.record):
            for reading in islice(sensor.stream(tare_frame=job.tare_frame), job.frames):
                sinks.write(reading)
                line = {"recording": job.name, **reading.summary(blame_of)}
                lines.append(json.dumps(line, allow_nan=False))
                deepest.append(line["max_height_mm"])
                warned += bool(reading.warnings)
                tared |= reading.frame.sequence == job.tare_frame
                yield _share(len(lines), job, sensor, reading)
        notes = sensor.notes
    if not tared:
        raise InputError(f"it has no frame {job.tare_frame} whose load could be subtracted")
    if folder is not None:
        text = "".join(f"{line}\n" for line in lines)
        folder.write(READINGS, lambda path: _write_text(path, text))
    return MeasuredRecording(
        job.name,
        job.recording,
        observations=len(lines),
        deepest_mm=max((depth for depth in deepest if depth is not None), default=None),
        warned=warned,
        notes=notes,
        _lines=tuple(lines),
    )


def _open_sensor(job: RecordingJob) -> Sensor:
    return open_sensor(
        job.profile,
        serial=job.serial,
        gel=job.gel,
        bundle=job.bundle,
        input=job.recording,
        reference=job.reference,
    )


def _share(count: int, job: RecordingJob, sensor: Sensor, reading: Reading) -> float:
    known = [total for total in (sensor.observations, job.frames) if total is not None]
    return min(1.0, count / min(known)) if known else 0.0


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
