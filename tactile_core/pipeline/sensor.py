"""Reads quantities from an open sensor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, Self

from tactile_core.acquisition.acquisition import average
from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import CameraLost, InputError
from tactile_core.interfaces.camera import Drop
from tactile_core.interfaces.device import Closing
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.frame_source import FrameSource, Measurement
from tactile_core.pipeline.health import Health
from tactile_core.pipeline.initial_reference import FIRST, InitialReference
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Quantity, Reference

if TYPE_CHECKING:
    from tactile_core.interfaces.recording_writer import RecordingWriter
    from tactile_core.recordings.recorded_source import RecordedSource
    from tactile_core.recordings.running_recording import RunningRecording

TIMEOUT_S = 1.0  # Default timeout of each exposure, s


class Sensor(Closing):
    """A sensor's acquisition and its :class:`~tactile_core.pipeline.pipeline.Pipeline`.

    Attributes
    ----------
    profile : Profile
    serial : str or None
        Serial number of the unit, if that was given.
    camera : Camera
        For what only its own kind can do.
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
        self.notes: tuple[str, ...] = ()
        self.observations: int | None = None
        self._recorded: RecordedSource | None = None
        if input is not None:
            from tactile_core.pipeline.playback import played_back

            profile, self.notes, self.observations, self._recorded = played_back(
                profile, Path(input)
            )
        self.profile = profile
        self.serial, self._gel, self._bundle = serial, gel, bundle
        self.damage = () if self._recorded is None else self._recorded.damage
        starting = bundle is not None and bundle.reference is None and bundle.manifest.starting
        self._reference = InitialReference(
            profile, reference, self._recorded, FIRST if starting else None
        )
        if starting and reference is None and self._reference.is_first and self.observations == 1:
            raise InputError(
                f"{input} is a single image, and what is not calibrated is measured relative to "
                f"another one; give --reference, an image of the undeformed sensor"
            )
        self._source = FrameSource(profile, timeout_s, reconnect_s)
        self.camera = self._source.camera
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
        return self.profile.name if self.serial is None else f"{self.profile.name} {self.serial}"

    def open(self) -> Self:
        """Open the lights and the camera; if that fails, nothing stays open.

        Before a live camera is opened, code is loaded, so that its first images do not wait; see
        :meth:`Pipeline.warm <tactile_core.pipeline.pipeline.Pipeline.warm>`.
        """
        with ExitStack() as opened:
            opened.push(self)
            if self.camera.live:
                self._reference.warm(self._bundle)
            self._source.open()
            self.notes += tuple(self.camera.notes)
            reference = self._reference.fetch_reference(self._source)
            self._pipeline = Pipeline(self.profile, self._bundle, reference, serial=self.serial)
            self.notes += self._pipeline.notes
            opened.pop_all()
        return self

    def close(self) -> None:
        """Switch the lights off and close all devices, even if one fails; may be called twice."""
        try:
            if self._pipeline is not None:
                self._pipeline.close()
        finally:
            self._source.close()

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

        It raises what :meth:`read` does.
        """
        return self._source.next(self.pipeline, timeout_s)

    def measure(self, frame: Frame, *inputs: Quantity, tare: bool = False) -> Reading:
        """Measure an observation that :meth:`acquire` has returned.

        External inputs and a tare are those of :meth:`Pipeline.process
        <tactile_core.pipeline.pipeline.Pipeline.process>`.
        """
        turn = None if self._recorded is None else self._recorded.turns.get(frame.sequence)
        if turn is not None:
            changed = self._reference.recorded_change(turn)
            if changed is not None:
                self.use_reference(changed)
            if turn.resumed:
                self.pipeline.resume()
            tare = tare or turn.tare
        return self._measurement.measure(self.pipeline, frame, *inputs, tare=tare)

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
            As of :meth:`Camera.set_drop <tactile_core.interfaces.camera.Camera.set_drop>`.
            Default: that of the camera.
        tare_frame : int, optional
            Sequence number of the frame whose load is subtracted from then on.
        workers : int
            As of :meth:`Pipeline.map <tactile_core.pipeline.pipeline.Pipeline.map>`.
        inputs : callable, optional
            Returns the external inputs of a frame, such as
            :class:`~tactile_core.recordings.recorded_source.SavedInputs`.

        Raises
        ------
        InputError
            Several workers, and a tare, external inputs or a step that depends on earlier frames.
        """
        self._source.set_drop(drop)
        if workers > 1:
            from tactile_core.pipeline.workers import check_any_order

            turns = self._recorded is not None and bool(self._recorded.turns)
            check_any_order(tare=tare_frame is not None, inputs=inputs is not None, turns=turns)
            frames = iter(partial(self.acquire, timeout_s), None)
            yield from self._measurement.measure_all(self.pipeline, frames, workers)
            return
        while (frame := self.acquire(timeout_s)) is not None:
            given = () if inputs is None else inputs(frame)
            yield self.measure(frame, *given, tare=frame.sequence == tare_frame)

    def record(
        self, path: Path | str | RecordingWriter, readings: bool = False, *, waits: bool = False
    ) -> RunningRecording:
        """Record what the camera sends from now on, until the result is closed.

        A thread of its own writes; the sensor never waits for it. Every image of a camera that
        sends images on its own is recorded, also those that are not read. Tracking from frame to
        frame starts again with the first recorded frame, so that a replay gives the same readings.

        Parameters
        ----------
        path : path or RecordingWriter
            A new ``.mcap`` file, or a new folder if the name has no ending; or what writes another.
        readings : bool
            Whether the quantities are recorded, too.
        waits : bool
            Whether the sensor waits for the disk, so that no image is left out; only if it is not
            live.

        Returns
        -------
        RunningRecording
            Use it in a ``with`` block. A full disk is its ``failure``, and a warning of a reading.

        Raises
        ------
        InputError
            The path exists, has an unknown ending, or a library is missing.
        OSError
            The file cannot be created.
        """
        from tactile_core.recordings.source import recording_writer

        writer = recording_writer(Path(path)) if isinstance(path, Path | str) else path
        return self._source.recordings.start(
            writer, self.pipeline, self.name, self._gel, readings=readings, waits=waits
        )

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
        begun = self._reference.recorded_start(self._bundle)
        if begun is not None:
            self.use_reference(begun)
        self.pipeline.reset()

    def tare(self) -> None:
        """Subtract the load of the next reading from it and from all later ones."""
        self.pipeline.tare()

    def use_bundle(self, bundle: Bundle) -> None:
        """Measure with another calibration from the next reading on.

        Its reference, if it has one, replaces that of the sensor, and tracking starts again.

        Raises
        ------
        CalibrationError
            The bundle belongs to another sensor.
        """
        former = self.pipeline
        kept = former.reference if bundle.reference is None else None
        self._pipeline = Pipeline(self.profile, bundle, kept, serial=self.serial)
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

        Nothing may touch the gel meanwhile. Near the end of a recording fewer are averaged.

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
