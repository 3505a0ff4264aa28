"""Converts recordings, and keeps one going."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import NamedTuple

from tactile_core.acquisition.free_running import HOST, Clock
from tactile_core.errors import InputError, PluginError
from tactile_core.formats.files import status
from tactile_core.formats.folders import fresh_folder, move_in, rename_new
from tactile_core.interfaces.calibration import Progress
from tactile_core.interfaces.recording_format import (
    REFERENCE,
    EventEntry,
    ImageEntry,
    RecordingFile,
)
from tactile_core.interfaces.recording_writer import RecordedImage
from tactile_core.interfaces.sink import Reading, Sink
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.playback import recorded_session
from tactile_core.pipeline.sensor import Sensor
from tactile_core.pipeline.sinks import CORE, Sinks
from tactile_core.plugins.blame import blame
from tactile_core.plugins.registry import list_plugins, resolve
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference
from tactile_core.recordings.inputs import Inputs
from tactile_core.recordings.output_folder import OutputFolder
from tactile_core.recordings.running_recording import RunningRecording
from tactile_core.recordings.session_files import profile_of
from tactile_core.recordings.source import (
    copy_formats,
    copy_writer,
    is_recorded,
    recording_file,
    writes,
)


def keep_recording(
    sensor: Sensor,
    recording: RunningRecording,
    *,
    seconds: float | None = None,
    frames: int | None = None,
    timeout_s: float = 1.0,
    clock: Clock = HOST,
) -> Iterator[float]:
    """Keep a recording going, and yield the completed fraction from time to time.

    Without readings nothing is measured, and images of a streaming camera are not even decoded.

    Parameters
    ----------
    sensor : Sensor
    recording : RunningRecording
        Of this sensor.
    seconds : float, optional
        Length. Default: until the camera's recording ends or the caller stops.
    frames : int, optional
        Number of observations.
    timeout_s : float
        Longest wait for an image.

    Raises
    ------
    OSError
        The recording failed.
    CameraTimeout, CameraLost, LightsLost, SequenceError
        As :meth:`Sensor.acquire <tactile_core.pipeline.sensor.Sensor.acquire>`.
    """
    began_s, done = clock.now(), 0
    watched = sensor.records_all and not recording.readings
    if watched:
        recording.limit = frames
    last, last_s = 0, began_s
    while True:
        elapsed_s = clock.now() - began_s
        shares = [0.0 if frames is None else done / frames]
        shares.append(0.0 if seconds is None else elapsed_s / seconds)
        yield min(1.0, max(shares))
        if recording.failure is not None:
            raise OSError(recording.failure)
        if max(shares) >= 1:
            return
        if watched:
            clock.sleep(0.1)  # [s] ten looks in a second seem continuous
            done = recording.images + recording.dropped
            if done > last:
                last, last_s = done, clock.now()
            elif clock.now() - last_s > timeout_s:
                sensor.acquire(timeout_s)  # says why nothing comes, or opens the camera again
                last_s = clock.now()
            continue
        frame = sensor.acquire(timeout_s)
        if frame is None:
            return
        if recording.readings:
            sensor.measure(frame)
        done += 1


class Converted(NamedTuple):
    """What was written.

    Attributes
    ----------
    path : Path
    kind : str
        ``recording``, or the name of the sink.
    written : int
        Images of a recording, observations of a sink.
    notes : tuple of str
        For the user.
    """

    path: Path
    kind: str
    written: int
    notes: tuple[str, ...] = ()


def convert(
    source: Path,
    out: Path,
    *,
    profile: Profile | str | None = None,
    sink: str | None = None,
    readings: bool = False,
    bundle: Path | None = None,
    reference: Reference | Path | str | None = None,
    progress: Progress | None = None,
) -> Converted:
    """Write a recording in another kind, completely or not at all.

    Parameters
    ----------
    source : Path
        A recording, or images or a video with their ``profile``.
    out : Path
        Does not exist. Its ending decides: ``.mcap``, none for a folder of images, or the ending of
        a plugin's recording format, such as ``.h5``, or of a sink.
    profile : Profile or str, optional
        Default: that in the recording.
    sink : str, optional
        Name of a sink that writes, in place of the one with the ending of ``out``.
    readings : bool
        Whether everything is measured, and the quantities are written, too. From recording to
        recording, images that no sensor measured are then left out.
    bundle, reference : optional
        For ``readings``. Default: those in the recording.
    progress : Progress, optional

    Raises
    ------
    InputError
        There is no ``source``, ``out`` exists, nothing writes its kind, or an argument is unusable.
    OSError
        The disk is full or not writable; nothing is left behind.
    """
    status(source)
    if os.path.lexists(out):
        raise InputError(f"{out} already exists, and nothing is overwritten; name another output")
    Inputs.from_paths({"the recording": source}).refuse_whole(out)
    writer = sink
    if writer is None and not writes(out):
        writer = _sink_for(out)
    advance = _progress(progress, f"converting to {out.name}")
    notes: tuple[str, ...] = ()
    with fresh_folder(out) as fresh:
        if writer is None and is_recorded(source) and not readings:
            count, notes = _copy(source, fresh / out.name, advance)
        else:
            options = {"bundle": bundle, "reference": reference}
            known = _profile(source, profile)
            with open_sensor(known, input=source, **options) as sensor:  # type: ignore[arg-type]
                notes = sensor.notes if readings else sensor.damage
                if writer is None:
                    count = _record(sensor, fresh / out.name, readings, advance)
                else:
                    count = _write(sensor, writer, fresh, readings, advance)
        _move(fresh, out)
    return Converted(out, writer or "recording", count, notes)


# Sinks of other distributions of this project that write one file or folder for a session.
_WRITTEN_BY = {".lerobot": "lerobot.dataset", ".rosbag": "rosbag.bag", ".rrd": "rerun.log"}


def session_sinks() -> Iterator[tuple[str, type[Sink]]]:
    """Yield name and class of the installed sinks that write one file or folder for a session."""
    for plugin in list_plugins():
        for short in plugin.components.get("sink", ()):
            name = f"{plugin.name}.{short}"
            with suppress(PluginError):
                kind: type[Sink] = resolve("sink", name)
                if kind.session_ending:
                    yield short if plugin.name == CORE else name, kind


def _sink_for(out: Path) -> str:
    endings: dict[str, str] = {}
    for name, kind in session_sinks():
        endings.setdefault(kind.session_ending, name)
    ending = out.suffix.lower()
    found = endings.get(ending)
    if found is None and ending in _WRITTEN_BY:
        resolve("sink", _WRITTEN_BY[ending])  # its error names the pip command
    if found is None:
        known = ", ".join(dict.fromkeys([".mcap", *copy_formats(), *endings, *_WRITTEN_BY]))
        raise InputError(
            f"nothing writes {out.suffix} files; end the output in {known}, or in nothing for a "
            f"folder of images, or name a sink with --sink"
        )
    return found


def _profile(source: Path, profile: Profile | str | None) -> Profile | str:
    if profile is not None:
        return profile
    session = recorded_session(source)
    if session is None:
        raise InputError(
            f"{source} does not say which sensor recorded it; name its profile with --profile"
        )
    return profile_of(session, source)


def _copy(source: Path, out: Path, advance: Callable[[float], None]) -> tuple[int, tuple[str, ...]]:
    """Copy a recording exactly: all sound images, events and references."""
    count = 0
    with recording_file(source) as file:
        writer = copy_writer(out)
        reads, writes = blame("the recording", file), blame("the copy", writer)
        with writes:
            writer.open(file.session)
        with writes, closing(writer):
            for number, entry in enumerate(file.entries):
                if isinstance(entry, EventEntry):
                    name = entry.values.get("name")
                    if entry.name == REFERENCE and isinstance(name, str):
                        with reads:
                            reference = file.reference(name)
                        writer.write_reference(name, reference)
                    writer.write_event(entry.name, entry.values)
                else:
                    with reads:
                        image = _read_image(file, entry)
                    writer.write_image(image)
                    count += 1
                advance((number + 1) / len(file.entries))
        return count, file.missing


def _read_image(file: RecordingFile, entry: ImageEntry) -> RecordedImage:
    about = entry.described
    return RecordedImage(
        file.image(entry),
        int(about["number"]),
        about.get("observation"),
        int(about.get("exposure_index") or 0),
        about.get("levels") or {},
    )


def _record(sensor: Sensor, out: Path, readings: bool, advance: Callable[[float], None]) -> int:
    with sensor.record(copy_writer(out), readings, waits=True) as recording:
        for _ in keep_recording(sensor, recording):
            advance(_share(sensor, recording.images))
    if recording.failure is not None:
        raise OSError(recording.failure)
    return recording.images


def _write(
    sensor: Sensor, name: str, folder: Path, readings: bool, advance: Callable[[float], None]
) -> int:
    sinks, count = Sinks(sensor.profile, [name]), 0
    sensor.keep_raw = sinks.keeps_raw
    with sinks.open(sensor.pipeline, OutputFolder(folder)):
        while (frame := sensor.acquire()) is not None:
            reading = sensor.measure(frame) if readings else Reading(frame, {}, {})
            sinks.write(reading)
            count += 1
            advance(_share(sensor, count))
    return count


def _share(sensor: Sensor, done: int) -> float:
    """Return the completed fraction; 0 for a video, whose length is unknown."""
    return 0.0 if not sensor.observations else min(1.0, done / sensor.observations)


def _move(fresh: Path, out: Path) -> None:
    """Move what was written to its place: the one file or folder, or all files of observations."""
    written = [path for path in fresh.iterdir() if not path.name.startswith(".")]
    if len(written) != 1 or written[0].suffix != out.suffix:
        move_in(fresh, out)
        return
    if written[0].is_dir():
        move_in(written[0], out)
    else:
        rename_new(written[0], out)
    for left in fresh.iterdir():
        left.unlink()
    fresh.rmdir()


def _progress(progress: Progress | None, words: str) -> Callable[[float], None]:
    if progress is None:
        return lambda share: None
    progress.stage(words, 1.0)
    return progress.fraction
