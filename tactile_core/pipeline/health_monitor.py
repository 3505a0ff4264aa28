"""Judges the health of a sensor from its readings as they come."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_core.acquisition.acquisition import CAMERA, Settings
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.camera_health import CameraHealth
from tactile_core.pipeline.gel_health import GelHealth
from tactile_core.pipeline.health import Finding, Health
from tactile_core.plugins.blame import blame


class HealthMonitor:
    """Collects what camera and readings show.

    Parameters
    ----------
    camera : Camera
    """

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._stream = CameraHealth(live=camera.live)
        self._gel = GelHealth()
        self._said: dict[str, Finding] = {}

    def add(
        self,
        reading: Reading,
        settings: Sequence[Settings],
        now_s: float,
    ) -> None:
        """Add a reading.

        Parameters
        ----------
        reading : Reading
        settings : sequence of Settings
            Of the exposures of the latest observation.
        now_s : float
            Time of the clock of a live camera's timestamps.
        """
        with blame(CAMERA, self._camera):
            counts, rate_hz = self._camera.statistics, self._camera.nominal_rate_hz
        self._stream.add(counts, rate_hz, settings, now_s)
        self._stream.add_reading(now_s - reading.frame.timestamp_s, reading.latency_ms / 1e3)
        self._gel.add(reading)

    def health(self) -> Health:
        """Judge what has come until now."""
        stream, gel = self._stream, self._gel
        return Health(
            rate=stream.rate(),
            latency=stream.latency(),
            dropped=stream.dropped(),
            torn=stream.torn(),
            repeated=stream.repeated(),
            exposure_time=stream.exposure_time(),
            lights=gel.lights(),
            saturated=gel.saturated(),
            markers=gel.markers(),
        )

    def warnings(self) -> tuple[str, ...]:
        """Return the sentences for the latest reading, but those that each reading has anyway.

        A sentence stays as it is, so that logs can merge it, until its value has changed by half.
        """
        found = {name: one for name, one in self.health().findings() if one.verdict == "warning"}
        found.pop("saturated", None)
        for name, one in found.items():
            said = self._said.get(name)
            if said is not None and _is_close(said.value, one.value):
                found[name] = said
        self._said = found
        return tuple(one.message for one in found.values())


def _is_close(said: float | None, now: float | None) -> bool:
    return said is None or now is None or abs(now - said) <= abs(said) / 2
