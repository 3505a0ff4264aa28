"""Reads quantities from an open sensor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import NoReturn, Self

from tactile_core.acquisition.acquisition import CAMERA, average
from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import CameraLost, InputError
from tactile_core.interfaces.camera import Camera, Drop
from tactile_core.interfaces.recording_writer import RecordingWriter
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.frame_source import FrameSource, Measurement
from tactile_core.pipeline.health import Health
from tactile_core.pipeline.initial_reference import InitialReference
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import played_back
from tactile_core.pipeline.sensor_recordings import session_of
from tactile_core.pipeline.workers import check_any_order
from tactile_core.plugins.blame import blame
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Quantity, Reference
from tactile_core.recordings.recorded_source import RecordedSource
from tactile_core.recordings.running_recording import RunningRecording
from tactile_core.recordings.source import recording_writer

TIMEOUT_S = 1.0  # Default timeout of each exposure, s


class Sensor:
    """A sensor's acquisition and its :class:`~tactile_core.pipeline.pipeline.Pipeline`.

    Attributes
    ----------
    profile : Profile
    notes : tuple of str
        For the user.
    damage : tuple of str
        Of the notes, that which says what of a damaged recording is left out.
    observations : int or None
        Number of observations of a recording; None if it is unknown before the end.
    """

    def __init__(
        self,
        profile: Profile,
        bundle: Bundle | None = None,
        reference: Reference | Path | str | None = None,
        *,
        serial: str | None = None,
        gel: str | None = None,
        input: Path | str | None = None,
        timeout_s: float = TIMEOUT_S,
        reconnect_s: float = 0.0,
    ) -> None:
        if not 0 < timeout_s < float("inf"):
            raise InputError(f"a timeout of {timeout_s:g} s? give a positive number of seconds")
        self.notes: tuple[str, ...] = ()
        count: int | None = None
        self._recorded: RecordedSource | None = None
        if input is not None:
            profile, self.notes, count, self._recorded = played_back(profile, Path(input))
        self.observations = count
        self.profile = profile
        self._serial, self._gel, self._bundle = serial, gel, bundle
        self.damage: tuple[str, ...] = ()
        of_recording: Reference | None = None
        if self._recorded is not None:
            self.damage = self._recorded.damage
            of_recording = self._recorded.own_reference() if reference is None else None
        self._reference = InitialReference(profile, reference, of_recording)
        self._source = FrameSource(profile, timeout_s, reconnect_s)
        self._measurement = Measurement(self._source)
        self._pipeline: Pipeline | None = None

    def __getstate__(self) -> NoReturn:
        raise InputError(
            "a sensor holds its camera and cannot be pickled or copied; give the other process "
            "sensor.pipeline and frames of sensor.acquire(), or open the sensor there"
        )

    @property
    def is_live(self) -> bool:
        """Whether the sensor shows a device in real time, not a recording or a virtual sensor."""
        return self.camera.live

    @property
    def camera(self) -> Camera:
        """The camera, for what only its own kind can do."""
        return self._source.camera

    @property
    def serial(self) -> str | None:
        """Serial number of the unit, if that was given."""
        return self._serial

    @property
    def records_all(self) -> bool:
        """Whether :meth:`record` takes every image that arrives, also those that nobody reads."""
        return self._source.recordings.streamed

    @property
    def keep_raw(self) -> bool:
        """Whether frames keep the images as the camera sent them, in ``frame.raw``."""
        return self._source.acquisition.keep_raw

    @keep_raw.setter
    def keep_raw(self, keep: bool) -> None:
        self._source.acquisition.keep_raw = keep

    @property
    def pipeline(self) -> Pipeline:
        """The pipeline that computes readings from this sensor's frames; picklable."""
        if self._pipeline is None:
            raise InputError("the sensor is closed; open it with 'with open_sensor(…) as sensor:'")
        return self._pipeline

    @property
    def name(self) -> str:
        """The profile's name, with the serial of the unit if that was given."""
        return self.profile.name if self._serial is None else f"{self.profile.name} {self._serial}"

    def open(self) -> Self:
        """Open the lights and the camera; if that fails, nothing stays open.

        Before a live camera is opened, code is loaded, so that its first images do not wait; see
        :meth:`Pipeline.warm <tactile_core.pipeline.pipeline.Pipeline.warm>`.
        """
        try:
            if self.camera.live:
                self._reference.warm(self._bundle)
            self._source.open()
            self.notes += tuple(self.camera.notes)
            reference = self._reference.fetch_reference(self._source)
            self._pipeline = Pipeline(self.profile, self._bundle, reference, serial=self._serial)
            self.notes += self._pipeline.notes
        except BaseException as error:
            try:
                self.close()
            except Exception as second:  # it must not hide why opening failed
                error.add_note(f"closing failed as well: {second}")
            raise
        return self

    def close(self) -> None:
        """Switch the lights off and close camera and driver, even if one of them fails.

        May be called twice.
        """
        try:
            if self._pipeline is not None:
                self._pipeline.close()
        finally:
            self._source.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except Exception as second:
            if error is None:
                raise
            error.add_note(f"closing failed as well: {second}")

    def read(self, timeout_s: float | None = None) -> Reading:
        """Acquire one observation and measure it.

        Parameters
        ----------
        timeout_s : float, optional
            Longest wait for each exposure. Default: that of the sensor.

        Raises
        ------
        CameraTimeout
            No observation within ``timeout_s`` per exposure.
        CameraLost, LightsLost
            The camera or the light box was disconnected and does not come back within the sensor's
            ``reconnect_s``, or the recording has ended.
        SequenceError
            Several observations in succession show the wrong lights. A single one is dropped, and
            the next reading has a warning.
        """
        frame = self.acquire(timeout_s)
        if frame is None:
            raise CameraLost("the recording has ended")
        return self.measure(frame)

    def acquire(self, timeout_s: float | None = None) -> Frame | None:
        """Acquire one observation without measuring it; return None at the end of a recording.

        Raises
        ------
        CameraTimeout, CameraLost, LightsLost, SequenceError
            As :meth:`read`.
        """
        return self._source.next(self.pipeline, timeout_s)

    def measure(self, frame: Frame) -> Reading:
        """Measure an observation that :meth:`acquire` has returned."""
        return self._process_frame(frame)

    def stream(
        self,
        timeout_s: float | None = None,
        *,
        drop: Drop | None = None,
        tare_frame: int | None = None,
        workers: int = 1,
        inputs: Callable[[Frame], Iterable[Quantity]] | None = None,
    ) -> Iterator[Reading]:
        """Yield readings until the recording ends; a live camera never ends.

        Parameters
        ----------
        timeout_s : float, optional
            Longest wait for each exposure. Default: that of the sensor.
        drop : {"oldest", "never"}, optional
            What happens to a live camera's images that arrive while earlier ones are measured; see
            :meth:`Camera.set_drop <tactile_core.interfaces.camera.Camera.set_drop>`. Default: that
            of the camera.
        tare_frame : int, optional
            Sequence number of the frame whose load is subtracted from then on.
        workers : int
            Number of processes; see :meth:`Pipeline.map
            <tactile_core.pipeline.pipeline.Pipeline.map>`.
        inputs : callable, optional
            Returns the external inputs of a frame, such as
            :class:`~tactile_core.recordings.recorded_source.SavedInputs`.

        Raises
        ------
        InputError
            There are several workers together with a tare, external inputs or a step that depends
            on earlier frames.
        """
        if drop not in (None, "oldest", "never"):
            raise InputError(f"drop={drop!r}? choose 'oldest' or 'never'")
        with blame(CAMERA, self.camera):
            self.camera.set_drop(drop)
        if workers > 1:
            turns = self._recorded is not None and bool(self._recorded.turns)
            check_any_order(tare=tare_frame is not None, inputs=inputs is not None, turns=turns)
            taken = iter(partial(self.acquire, timeout_s), None)
            frames = map(partial(self._measurement.begin, self.pipeline), taken)
            readings = self.pipeline.map(frames, workers=workers)
            yield from map(partial(self._measurement.note_reading, self.pipeline), readings)
            return
        while (frame := self.acquire(timeout_s)) is not None:
            given = () if inputs is None else inputs(frame)
            yield self._process_frame(frame, *given, tare=frame.sequence == tare_frame)

    def record(self, path: Path | str, readings: bool = False) -> RunningRecording:
        """Record what the camera sends from now on, until the result is closed.

        A thread of its own writes; the sensor never waits for it. Every image of a camera that
        sends images on its own is recorded, also those that are not read. Tracking from frame to
        frame starts again with the first recorded frame, so that a replay gives the same readings.

        Parameters
        ----------
        path : path
            A new ``.mcap`` file, or a new folder if the name has no ending.
        readings : bool
            Whether the quantities are recorded, too.

        Returns
        -------
        RunningRecording
            Use it in a ``with`` block. If the disk is full, ``failure`` says so, and the next
            reading has it as a warning; the sensor goes on.

        Raises
        ------
        InputError
            The path exists, has an unknown ending, or a library is missing.
        OSError
            The file cannot be created.
        """
        return self.record_with(recording_writer(Path(path)), readings)

    def record_with(
        self, writer: RecordingWriter, readings: bool = False, *, waits: bool = False
    ) -> RunningRecording:
        """Record as :meth:`record` does, with a writer of one's own.

        Parameters
        ----------
        writer : RecordingWriter
        readings : bool
        waits : bool
            Whether the sensor waits for the disk, so that no image is left out; only if it is not
            live.

        Raises
        ------
        InputError, OSError
            The file cannot be created.
        """
        session = session_of(
            self.pipeline,
            sensor=self.name,
            exposures=len(self._source.acquisition.exposures),
            gel=self._gel,
            tared=self._measurement.tared,
        )
        recording = RunningRecording(writer, session, readings=readings, waits=waits)
        self._source.recordings.add(recording)
        return recording

    def health(self) -> Health:
        """Judge the camera, the lights, the markers and the gel from the readings until now.

        Each reading has the sentences of :attr:`Health.warnings
        <tactile_core.pipeline.health.Health.warnings>` among its own warnings.
        """
        return self._measurement.health()

    def rewind(self) -> None:
        """Play a recording, or a script of the virtual sensor, from its beginning.

        All that depends on earlier frames is forgotten, a tare too. The reference stays, unless the
        recording itself has changed it.

        Raises
        ------
        InputError
            The sensor is live.
        DeviceError
            The recording cannot be opened again.
        """
        if self.is_live:
            raise InputError(f"{self.name} is live, so it cannot be rewound; open a recording")
        self._source.rewind()
        recorded = self._recorded
        if recorded is not None and recorded.changes_reference:
            begun = recorded.session.reference or (self._bundle and self._bundle.reference)
            if begun and not self._reference.is_given:
                self.use_reference(begun)
        self.pipeline.reset()

    def tare(self) -> None:
        """Subtract the load of the next reading from it and from all later ones."""
        self.pipeline.tare()

    def use_bundle(self, bundle: Bundle) -> None:
        """Measure with another calibration from the next reading on.

        The bundle's reference, if it holds one, replaces that of the sensor, and tracking starts
        again.

        Raises
        ------
        CalibrationError
            The bundle belongs to another sensor.
        """
        former = self.pipeline
        kept = former.reference if bundle.reference is None else None
        self._pipeline = Pipeline(self.profile, bundle, kept, serial=self._serial)
        self._bundle = bundle
        former.close()
        if self._pipeline.reference is not None:
            self._source.recordings.record_reference(self._pipeline.reference)

    def use_reference(self, reference: Reference) -> None:
        """Use another reference from the next reading on.

        Raises
        ------
        InputError
            It does not match the profile.
        """
        self._pipeline = self.pipeline.with_reference(reference)
        self._source.recordings.record_reference(reference)

    def capture_reference(self, frames: int = 10) -> Reference:
        """Use the mean of the next ``frames`` observations as the new reference.

        Nothing may touch the gel during this time. Near the end of a recording it is the mean of
        those that are left.

        Raises
        ------
        InputError
            No observation is left.
        """
        taken = [frame for frame in (self.acquire() for _ in range(frames)) if frame is not None]
        if frames > 0 and not taken:
            raise InputError(f"{self.name} has no observation left for a reference; play it again")
        reference = average(taken)
        self.use_reference(reference)
        return self.pipeline.reference or reference

    def _process_frame(self, frame: Frame, *inputs: Quantity, tare: bool = False) -> Reading:
        turn = None if self._recorded is None else self._recorded.turns.get(frame.sequence)
        if self._recorded is not None and turn is not None:
            if turn.reference is not None and not self._reference.is_given:
                self.use_reference(self._recorded.reference(turn.reference))
            if turn.resumed:
                self.pipeline.resume()
            tare = tare or turn.tare
        tare = tare or self.pipeline.tares
        self._measurement.begin(self.pipeline, frame, tare=tare)
        reading = self.pipeline.process(frame, *inputs, tare=tare)
        return self._measurement.note_reading(self.pipeline, reading)
