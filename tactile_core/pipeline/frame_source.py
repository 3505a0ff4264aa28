"""Where frames come from, and what is measured in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.acquisition.devices import CAMERA, DRIVER, make_devices
from tactile_core.acquisition.free_running import HOST, Clock
from tactile_core.errors import CameraLost, DeviceError, InputError, LightsLost, TactileError
from tactile_core.interfaces.camera import Drop
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.frame_check import LiveCheck
from tactile_core.pipeline.health import Health
from tactile_core.pipeline.health_monitor import HealthMonitor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sensor_recordings import SensorRecordings
from tactile_core.plugins.blame import blame
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Image, Quantity

LOST = (CameraLost, LightsLost)  # Errors after which the devices can be opened again


class Reconnection:
    """Closes and opens the devices until all are there, for a limited time.

    Parameters
    ----------
    patience_s : float
        Time from the loss to the last attempt; 0 for none. An attempt takes as long as opening.
    open, close : callable
        Open and close all devices; ``open`` leaves the work to ``close`` if it fails.
    clock : Clock
    """

    def __init__(
        self,
        patience_s: float,
        open: Callable[[], None],
        close: Callable[[], None],
        clock: Clock = HOST,
    ) -> None:
        if not patience_s >= 0:
            raise InputError(f"reconnect_s is {patience_s:g}; give the seconds, 0 for never")
        self._patience_s, self._clock = patience_s, clock
        self._open, self._close = open, close
        self._last_s = clock.now()
        self._lost = ""
        self._warning = ""

    def after(self, error: DeviceError) -> None:
        """Open the devices again.

        Raises
        ------
        DeviceError
            The given error: they cannot be opened in time, with the latest reason as a note.
        """
        if not self._patience_s:
            raise error
        until_s = self._clock.now() + self._patience_s
        self._lost = "the light box" if isinstance(error, LightsLost) else "the camera"
        while True:
            self._close_all()
            try:
                self._open()
            except TactileError as reason:
                left_s = until_s - self._clock.now()
                if left_s <= 0:
                    error.add_note(f"not opened again within {self._patience_s:g} s: {reason}")
                    raise error from reason
                # [s] a small part of the second in which a USB device starts
                self._clock.sleep(min(0.1, left_s))
            else:
                return

    def saw(self, frame: Frame) -> None:
        """Note a frame; the first one after a loss ends the gap."""
        if self._lost:
            self._warning = (
                f"{self._lost} was lost, and there was no frame for "
                f"{frame.timestamp_s - self._last_s:.1f} s; reference and tare are kept, but slip "
                f"and whatever is measured from frame to frame have started again"
            )
            self._lost = ""
        self._last_s = frame.timestamp_s

    def warnings(self) -> tuple[str, ...]:
        """Return the warning for the first reading after a gap, once."""
        warning, self._warning = self._warning, ""
        return (warning,) if warning else ()

    def _close_all(self) -> None:
        with suppress(TactileError):  # what is gone may not close, and why it was lost is known
            self._close()


class FrameSource:
    """A sensor's devices, what they acquire, and what of it is recorded.

    Parameters
    ----------
    profile : Profile
    timeout_s : float
        Longest wait for each exposure.
    reconnect_s : float
        How long to try to open a lost live camera or light box again.

    Attributes
    ----------
    camera : Camera
    driver : LightDriver or None
    acquisition : Acquisition
    recordings : SensorRecordings
    """

    def __init__(self, profile: Profile, timeout_s: float, reconnect_s: float) -> None:
        if not 0 < timeout_s < float("inf"):
            raise InputError(f"a timeout of {timeout_s:g} s? give a positive number of seconds")
        self.camera, illumination, self.driver = make_devices(profile)
        self.acquisition = Acquisition(self.camera, illumination, profile.image, self.driver)
        self.recordings = SensorRecordings(self.camera, self.acquisition)
        self._check = LiveCheck(self.acquisition)
        self._reconnection = Reconnection(reconnect_s, self.open, self._close_devices)
        self._timeout_s = timeout_s
        self._pending: list[tuple[Frame, tuple[Image, ...]]] = []

    def open(self) -> None:
        """Open the lights, then the camera; after an error, :meth:`close` them.

        Raises
        ------
        DeviceError
            One of them cannot be opened.
        """
        if self.driver is not None:
            with blame(DRIVER, self.driver):
                self.driver.attach(self.camera)
                self.driver.open()
        with blame(CAMERA, self.camera):
            self.camera.open()
        if self.driver is not None and self.driver.watchdog_s is None:
            self._darken()  # a program that was killed may have left the lights on
        self.acquisition.arm()

    def close(self) -> None:
        """Switch the lights off, close all devices, and then complete the recordings."""
        try:
            self._close_devices()
        finally:
            self.recordings.close()

    def set_drop(self, drop: Drop | None) -> None:
        """Choose what happens to images that nobody has read; see :meth:`Camera.set_drop`."""
        if drop not in (None, "oldest", "never"):
            raise InputError(f"drop={drop!r}? choose 'oldest' or 'never'")
        with blame(CAMERA, self.camera):
            self.camera.set_drop(drop)

    def first(self) -> Frame:
        """Acquire the first frame, which :meth:`next` will return again.

        Raises
        ------
        InputError
            There is none.
        """
        frame = self.acquisition.observe(self._timeout_s)
        if frame is None:
            raise InputError("the input has no frame to use as reference")
        self._pending.append((frame, self.acquisition.images))
        return frame

    def next(self, pipeline: Pipeline, timeout_s: float | None = None) -> Frame | None:
        """Acquire one frame; return None at the end of a recording.

        Parameters
        ----------
        pipeline : Pipeline
            It verifies a live frame's lights, and starts tracking again after a gap.
        timeout_s : float, optional
            Longest wait for each exposure.
        """
        if self._pending:
            frame, images = self._pending.pop(0)
            self._reconnection.saw(frame)
            self.recordings.record_observation(frame, images, earlier=True)
            return replace(frame, raw=images) if self.acquisition.keep_raw else frame
        found = self._acquire_frame(pipeline, self._timeout_s if timeout_s is None else timeout_s)
        if found is not None:
            self.recordings.record_observation(found, self.acquisition.images)
        return found

    def rewind(self) -> None:
        """Start a recording again."""
        self._pending.clear()
        self._close_devices()
        self.open()
        self.acquisition.restart()

    def add_warnings(self, reading: Reading) -> Reading:
        """Add the warnings about dropped observations, lost devices and failed recordings."""
        reading = self._check.add_warnings(reading)
        added = (*self._reconnection.warnings(), *self.recordings.warnings())
        return replace(reading, warnings=(*reading.warnings, *added)) if added else reading

    def _acquire_frame(self, pipeline: Pipeline, timeout_s: float) -> Frame | None:
        if not self.camera.live:
            return self.acquisition.observe(timeout_s)
        while True:
            try:
                frame = self._check.observe(pipeline.conditioning.verify, timeout_s)
            except LOST as error:
                self._reconnection.after(error)
                pipeline.resume()
                self.recordings.record_resumption()
            else:
                if frame is not None:
                    self._reconnection.saw(frame)
                return frame

    def _close_devices(self) -> None:
        """Switch the lights off and close both, even if one of them fails."""
        # not an ExitStack: it never returns if a device raises the same error object repeatedly
        try:
            self._darken()
        finally:
            try:
                with blame(CAMERA, self.camera):
                    self.camera.close()
            finally:
                if self.driver is not None:
                    with blame(DRIVER, self.driver):
                        self.driver.close()

    def _darken(self) -> None:
        # lights that are driven through the camera work only while the camera is open
        if self.driver is not None and self.driver.is_open:
            with blame(DRIVER, self.driver):
                self.driver.set({})


class Measurement:
    """Measures frames: records readings, judges the health by them, and adds warnings to them.

    Parameters
    ----------
    source : FrameSource
    """

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._monitor = HealthMonitor(source.camera)
        self._began = False

    def health(self) -> Health:
        """Judge the camera, the lights and the markers from the readings until now."""
        return self._monitor.health()

    def measure(self, pipeline: Pipeline, frame: Frame, *inputs: Quantity, tare: bool) -> Reading:
        """Measure a frame; the arguments are those of :meth:`Pipeline.process`."""
        tare = tare or pipeline.tares
        self._begin(pipeline, frame, tare=tare)
        return self._note_reading(pipeline.process(frame, *inputs, tare=tare))

    def measure_all(
        self, pipeline: Pipeline, frames: Iterator[Frame], workers: int
    ) -> Iterator[Reading]:
        """Measure frames in several processes; see :meth:`Pipeline.map`."""
        begun = map(partial(self._begin, pipeline), frames)
        return map(self._note_reading, pipeline.map(begun, workers=workers))

    def _begin(self, pipeline: Pipeline, frame: Frame, *, tare: bool = False) -> Frame:
        """Note that a frame is about to be measured, and return it."""
        if self._source.recordings.measuring(frame, tare=tare) and self._began:
            pipeline.resume()
        self._began = True
        return frame

    def _note_reading(self, reading: Reading) -> Reading:
        """Note a reading, and add the warnings that concern the devices and the markers."""
        self._monitor.add(reading, self._source.acquisition.settings, HOST.now())
        reading = self._source.add_warnings(reading)
        added = self._monitor.warnings()
        if added:
            reading = replace(reading, warnings=(*reading.warnings, *added))
        self._source.recordings.healthy(self._monitor)
        self._source.recordings.record_reading(reading)
        return reading
