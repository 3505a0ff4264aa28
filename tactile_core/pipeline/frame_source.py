"""Acquires a sensor's frames, from its devices or from a recording."""

from __future__ import annotations

from dataclasses import replace

from tactile_core.acquisition.acquisition import Acquisition, Settings
from tactile_core.errors import InputError
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.live_check import LiveCheck
from tactile_core.pipeline.open_devices import OpenDevices
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import make_devices
from tactile_core.pipeline.reconnection import LOST, Reconnection
from tactile_core.pipeline.sensor_recordings import SensorRecordings
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Image


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
    recordings : SensorRecordings
    """

    def __init__(self, profile: Profile, timeout_s: float, reconnect_s: float) -> None:
        self.camera, illumination, self.driver = make_devices(profile)
        self._acquisition = Acquisition(self.camera, illumination, profile.image, self.driver)
        self.recordings = SensorRecordings(self.camera, self._acquisition)
        self._devices = OpenDevices(self.camera, self.driver, self._acquisition)
        self._check = LiveCheck(self._acquisition)
        self._reconnection = Reconnection(reconnect_s, self._devices.open, self._devices.close)
        self._timeout_s = timeout_s
        self._pending: list[tuple[Frame, tuple[Image, ...]]] = []

    @property
    def exposures(self) -> int:
        """Images of one observation."""
        return len(self._acquisition.exposures)

    @property
    def settings(self) -> tuple[Settings, ...]:
        """Exposure time and gain of each exposure of the latest observation, as read back."""
        return self._acquisition.settings

    @property
    def keep_raw(self) -> bool:
        """Whether frames keep the images as the camera sent them, in ``frame.raw``."""
        return self._acquisition.keep_raw

    @keep_raw.setter
    def keep_raw(self, keep: bool) -> None:
        self._acquisition.keep_raw = keep

    def open(self) -> None:
        """Open the lights and the camera; after an error, :meth:`close` them."""
        self._devices.open()

    def close(self) -> None:
        """Switch the lights off, close all devices, and then complete the recordings."""
        try:
            self._devices.close()
        finally:
            self.recordings.close()

    def first(self) -> Frame:
        """Acquire the first frame, which :meth:`next` will return again.

        Raises
        ------
        InputError
            There is none.
        """
        self._acquisition.keep_images = True
        frame = self._acquisition.observe(self._timeout_s)
        self._acquisition.keep_images = False
        if frame is None:
            raise InputError("the input has no frame to use as reference")
        self._pending.append((frame, self._acquisition.images))
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
            self.recordings.acquired(frame, images, earlier=True)
            return replace(frame, raw=images) if self.keep_raw else frame
        found = self._acquired(pipeline, self._timeout_s if timeout_s is None else timeout_s)
        if found is not None:
            self.recordings.acquired(found, self._acquisition.images)
        return found

    def rewind(self) -> None:
        """Start a recording again."""
        self._pending.clear()
        self._devices.close()
        self._devices.open()
        self._acquisition.restart()

    def noted(self, reading: Reading) -> Reading:
        """Add the warnings about dropped observations, lost devices and failed recordings."""
        reading = self._check.noted(reading)
        added = (*self._reconnection.warnings(), *self.recordings.warnings())
        return replace(reading, warnings=(*reading.warnings, *added)) if added else reading

    def _acquired(self, pipeline: Pipeline, timeout_s: float) -> Frame | None:
        if not self.camera.live:
            return self._acquisition.observe(timeout_s)
        while True:
            try:
                frame = self._check.observe(pipeline.conditioning.verify, timeout_s)
            except LOST as error:
                self._reconnection.after(error)
                pipeline.resume()
                self.recordings.resumed()
            else:
                if frame is not None:
                    self._reconnection.saw(frame)
                return frame
