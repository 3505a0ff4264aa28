"""The recordings of a sensor that are being written."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.acquisition.free_running import HOST
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.component import VIRTUAL_CAMERA
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.health_monitor import HealthMonitor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.plugins.entry_points import library_versions
from tactile_core.quantities import Frame, Image, Reference

if TYPE_CHECKING:
    from tactile_core.interfaces.recording_writer import RecordedSession, RecordingWriter
    from tactile_core.interfaces.streaming.image_queue import Tap
    from tactile_core.interfaces.streaming.streaming_camera import StreamingCamera
    from tactile_core.recordings.running_recording import RunningRecording


class SensorRecordings:
    """Passes what a sensor does to its recordings.

    All images that a streaming camera sends are recorded if each is an observation; else the
    exposures of each observation.

    Parameters
    ----------
    camera : Camera
    acquisition : Acquisition
    """

    def __init__(self, camera: Camera, acquisition: Acquisition) -> None:
        self._camera, self._acquisition = camera, acquisition
        self._levels: tuple[Mapping[str, float], ...] = tuple(
            exposure.levels for exposure in acquisition.exposures
        )
        self._running: tuple[RunningRecording, ...] = ()
        self._taps: dict[RunningRecording, Tap] = {}
        self._begun: set[RunningRecording] = set()
        self._reported: set[tuple[RunningRecording, bool]] = set()
        self._health_at_s = float("-inf")
        self._tared = False

    @property
    def streamed(self) -> bool:
        """Whether every image that arrives is recorded, also those that nobody reads."""
        return self._stream is not None

    @property
    def _stream(self) -> StreamingCamera | None:
        """The camera, if it sends images on its own and each is an observation."""
        # loaded already if the camera is one
        from tactile_core.interfaces.streaming.streaming_camera import StreamingCamera

        if self._acquisition.triggers or len(self._acquisition.exposures) > 1:
            return None
        return self._camera if isinstance(self._camera, StreamingCamera) else None

    def start(
        self,
        writer: RecordingWriter,
        pipeline: Pipeline,
        sensor: str,
        gel: str | None,
        *,
        readings: bool,
        waits: bool,
    ) -> RunningRecording:
        """Record from now on; see :meth:`Sensor.record` and :func:`session_of`.

        Raises
        ------
        InputError, OSError
            The file cannot be created.
        """
        # no sensor needs it before it records
        from tactile_core.recordings.running_recording import RunningRecording

        exposures = len(self._acquisition.exposures)
        session = session_of(
            pipeline, sensor=sensor, exposures=exposures, gel=gel, tared=self._tared
        )
        recording = RunningRecording(writer, session, readings=readings, waits=waits)
        self._running = (*self._running, recording)
        self._health_at_s = float("-inf")
        if self._stream is not None:
            tap = self._taps[recording] = partial(recording.add_image, levels=self._levels[0])
            self._stream.add_tap(tap)
        return recording

    def record_observation(
        self, frame: Frame, images: tuple[Image, ...], *, earlier: bool = False
    ) -> None:
        """Record an observation; ``earlier`` if it was acquired before the recordings began."""
        for recording in self._open():
            if not self.streamed:
                recording.add_observation(frame, images, self._levels)
            elif earlier:
                recording.add_image(images[0], self._levels[0])

    def measuring(self, frame: Frame, *, tare: bool) -> bool:
        """Record that a frame is measured; return whether tracking must start again with it.

        It must with the first frame of a recording, because a replay starts with it.
        """
        self._tared = self._tared or tare
        known = [one for one in self._open() if one.knows(frame, streamed=self.streamed)]
        new = [one for one in known if one not in self._begun]
        for recording in known:
            if new and recording not in new:
                recording.add_event("resumed", {})
            recording.add_measured(frame, tare=tare, streamed=self.streamed)
        self._begun.update(new)
        return bool(new)

    def record_reading(self, reading: Reading) -> None:
        """Record a reading."""
        for recording in self._open():
            recording.add_reading(reading)

    def record_reference(self, reference: Reference) -> None:
        """Record a new reference."""
        for recording in self._open():
            recording.add_reference(reference)

    def record_resumption(self) -> None:
        """Record that tracking started again."""
        for recording in self._open():
            recording.add_event("resumed", {})

    def healthy(self, monitor: HealthMonitor) -> None:
        """Record the sensor's health from time to time."""
        if self._running and HOST.now() >= self._health_at_s:
            self._health_at_s = HOST.now() + 10.0  # s: health counts images over as long
            summary = monitor.health().summary()
            for recording in self._open():
                recording.add_event("health", summary)

    def warnings(self) -> tuple[str, ...]:
        """Return why recordings have ended early or leave images out, once each."""
        said = {(one, bool(one.failure)): one.failure or one.left_out() for one in self._running}
        new = {kind: words for kind, words in said.items() if words and kind not in self._reported}
        self._reported.update(new)
        return tuple(new.values())

    def close(self) -> None:
        """Complete all recordings."""
        for recording in self._running:
            recording.close()
        self._open()

    def _open(self) -> tuple[RunningRecording, ...]:
        for recording in [one for one in self._running if one.is_closed]:
            self._running = tuple(one for one in self._running if one is not recording)
            self._begun.discard(recording)
            if self._stream is not None:
                self._stream.remove_tap(self._taps.pop(recording))
        return self._running


def session_of(
    pipeline: Pipeline, *, sensor: str, exposures: int, gel: str | None, tared: bool
) -> RecordedSession:
    """Return what a recording holds of a sensor.

    Parameters
    ----------
    pipeline : Pipeline
    sensor : str
        Name of the sensor, for people.
    exposures : int
        Images of one observation.
    gel : str or None
    tared : bool
        Whether a load is being subtracted already.
    """
    from tactile_core.interfaces.recording_writer import RecordedSession
    from tactile_core.recordings.session_files import bundle_content, profile_text

    bundle = pipeline.bundle
    named = gel or (None if bundle is None else bundle.manifest.gel_id) or None
    return RecordedSession(
        profile=profile_text(pipeline.profile),
        sensor=sensor,
        channels=pipeline.channels,
        exposures=exposures,
        sim=pipeline.profile.camera.use == VIRTUAL_CAMERA,
        serial=pipeline.serial,
        gel=named,
        bundle=None if bundle is None else bundle_content(bundle),
        reference=pipeline.given_reference,
        software=library_versions(),
        started=datetime.now(UTC).isoformat(timespec="milliseconds"),
        tared=tared,
    )
