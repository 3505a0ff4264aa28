"""What a sensor notes of the frames that it measures."""

from __future__ import annotations

from dataclasses import replace

from tactile_core.acquisition.free_running import HOST
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.frame_source import FrameSource
from tactile_core.pipeline.health import Health
from tactile_core.pipeline.health_monitor import HealthMonitor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.quantities import Frame


class Measurement:
    """Records what is measured, judges the sensor's health by it, and adds warnings to readings.

    Parameters
    ----------
    source : FrameSource

    Attributes
    ----------
    tared : bool
        Whether the load of some frame is being subtracted.
    """

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._monitor = HealthMonitor(source.camera)
        self._began = self.tared = False

    def health(self) -> Health:
        """Judge the camera, the lights and the markers from the readings until now."""
        return self._monitor.health()

    def begin(self, pipeline: Pipeline, frame: Frame, *, tare: bool = False) -> Frame:
        """Note that a frame is about to be measured, and return it."""
        if self._source.recordings.measuring(frame, tare=tare) and self._began:
            pipeline.resume()
        self._began, self.tared = True, self.tared or tare
        return frame

    def note_reading(self, pipeline: Pipeline, reading: Reading) -> Reading:
        """Note a reading, and add the warnings that concern the devices and the markers."""
        self._monitor.add(reading, self._source.settings, HOST.now())
        reading = self._source.add_warnings(reading)
        added = self._monitor.warnings()
        if added:
            reading = replace(reading, warnings=(*reading.warnings, *added))
        self._source.recordings.healthy(self._monitor)
        self._source.recordings.record_reading(reading)
        return reading
