"""The health of cameras, and the monitor of everything that ages or fails."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from statistics import median

from tactile_core.acquisition.acquisition import Settings
from tactile_core.acquisition.devices import CAMERA
from tactile_core.interfaces.camera import Camera, StreamStatistics
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.health import Finding, GelHealth, Health
from tactile_core.plugins.blame import blame

# [s] Time over which images are counted: 300 images at 30 Hz, so that a share of 1 % is more than
# one image
_WINDOW_S = 10.0
_FEWEST = 10  # [images] Images from which a share is judged: one image in ten is chance
_READINGS = 30  # [count] Readings of which a median is taken: one second at 30 Hz


class CameraHealth:
    """Collects what a camera reports.

    Parameters
    ----------
    live : bool
        Whether the camera shows a device in real time.
    """

    def __init__(self, *, live: bool) -> None:
        self._live = live
        self._counts: deque[tuple[float, StreamStatistics]] = deque()
        self._ages_s: deque[float] = deque(maxlen=_READINGS)
        self._measuring_s: deque[float] = deque(maxlen=_READINGS)
        self._opened_s = float("inf")
        self._nominal_hz: float | None = None
        self._best_hz = self._rate_hz = 0.0
        self._settings: tuple[Settings, ...] = ()
        self._first_settings: tuple[Settings, ...] = ()

    def add(
        self,
        statistics: StreamStatistics | None,
        nominal_hz: float | None,
        settings: Sequence[Settings],
        now_s: float,
    ) -> None:
        """Add what the camera reports after an observation."""
        self._nominal_hz, self._settings = nominal_hz, tuple(settings)
        self._first_settings = self._first_settings or self._settings
        if statistics is None:
            return
        if self._counts and statistics.received < self._counts[-1][1].received:
            self._counts.clear()  # the camera was opened again
        if not self._counts:
            self._opened_s = now_s
        self._counts.append((now_s, statistics))
        while self._counts[0][0] < now_s - _WINDOW_S:
            self._counts.popleft()
        # a median: images that were held up, as over Wi-Fi, arrive in a burst, which is no rate
        self._rate_hz = median(counts.rate_hz for _, counts in self._counts)
        if now_s - self._opened_s >= _WINDOW_S:
            self._best_hz = max(self._best_hz, self._rate_hz)

    def add_reading(self, age_s: float, measuring_s: float) -> None:
        """Add a reading's age since mid-observation, and the part that measuring took."""
        if self._live:
            self._ages_s.append(age_s)
            self._measuring_s.append(measuring_s)

    @property
    def _is_settled(self) -> bool:
        # [s] the time over which the rate is measured
        return self._counts[-1][0] - self._opened_s >= 2.0

    def rate(self) -> Finding:
        """Images that arrive each second."""
        if not self._counts:
            return Finding.unknown(self._no_stream, unit="Hz")
        if not (self._rate_hz and self._is_settled):
            return Finding.unknown("the stream has just begun", self._rate_hz, "Hz")
        expected_hz = self._nominal_hz or max(self._best_hz, self._rate_hz)
        problem = ""
        # [ratio] Webcams that lengthen the exposure in the dark fall to half; one lost image in ten
        # is no change
        if self._rate_hz < 0.8 * expected_hz:
            problem = (
                f"{self._rate_hz:.1f} images arrive each second instead of {expected_hz:.1f}; lock "
                f"an exposure shorter than the frame period, and give the camera a USB port of its "
                f"own"
            )
        return Finding.from_value(self._rate_hz, expected_hz, "Hz", problem)

    def latency(self) -> Finding:
        """Time from mid-observation to the reading, as a median."""
        if not self._ages_s:
            return Finding.unknown("a recording has no latency", unit="ms")
        age_s, measuring_s = median(self._ages_s), median(self._measuring_s)
        if not self._rate_hz:
            return Finding.unknown("the frame period is unknown", 1e3 * age_s, "ms")
        period_s = 1 / self._rate_hz
        exposures_s = sum(one.exposure_time_s or period_s for one in self._settings)
        # [frame periods] Readout and transfer take 1.5 at most; twice that: images wait in a buffer
        waiting_s = 3.0 * period_s * max(1, len(self._settings))
        usual_s = measuring_s + exposures_s + waiting_s
        problem = ""
        if age_s > usual_s:
            problem = (
                f"readings come {1e3 * age_s:.0f} ms after mid-exposure, of which measuring takes "
                f"{1e3 * measuring_s:.0f} ms, so images wait; use drop='oldest' and read without "
                f"pauses"
            )
        return Finding.from_value(1e3 * age_s, 1e3 * usual_s, "ms", problem)

    def dropped(self) -> Finding:
        """Images that were not read because newer ones came first."""
        if not self._counts:
            return Finding.unknown(self._no_stream)
        count, images = self._recent("dropped")
        busy_s = median(self._measuring_s or [0.0])
        problem = ""
        # who reads rarely drops images on purpose; between sequential lights some are useless
        rests = busy_s * self._rate_hz < 1 or len(self._settings) > 1
        if count and images >= _FEWEST and not rests:
            problem = (
                f"{count} of {images} images were not measured, because that takes "
                f"{1e3 * busy_s:.0f} ms and an image comes every {1e3 / self._rate_hz:.0f} ms; "
                "leave out steps or make the image smaller"
            )
        return Finding.from_value(count, None, "", problem)

    def torn(self) -> Finding:
        """Images that arrived damaged."""
        remedy = "arrived torn; change the cable, or connect the camera without a hub"
        return self._share("torn", 0.01, remedy)  # [share of the images] good cables tear none

    def repeated(self) -> Finding:
        """Images that equal the one before."""
        remedy = "repeat the one before; lower the camera's rate to one that it keeps"
        return self._share("repeated", 0.2, remedy)  # [share of the images] no longer chance

    def exposure_time(self) -> Finding:
        """Exposure time as read back; that which has changed most since the beginning."""
        pairs = [
            (now.exposure_time_s, then.exposure_time_s)
            for now, then in zip(self._settings, self._first_settings, strict=False)
            if now.exposure_time_s and then.exposure_time_s
        ]
        if not pairs:
            return Finding.unknown("the camera does not report its exposure", unit="s")
        now_s, then_s = max(pairs, key=lambda pair: abs(pair[0] / pair[1] - 1))
        problem = ""
        if abs(now_s / then_s - 1) > 0.05:  # [ratio] half of what is compensated
            problem = (
                f"the camera has changed its exposure from {1e3 * then_s:.1f} ms to "
                f"{1e3 * now_s:.1f} ms; write 'exposure_time_s' in 'camera', which locks it"
            )
        return Finding.from_value(now_s, then_s, "s", problem)

    @property
    def _no_stream(self) -> str:
        if self._live:
            return "the camera takes its images on request"
        return "a recording is read as fast as it is measured"

    def _recent(self, kind: str) -> tuple[int, int]:
        """Return how many images of a kind, and how many in all, came in the window."""
        (_, before), (_, now) = self._counts[0], self._counts[-1]
        all_now, all_before = (one.received + one.torn for one in (now, before))
        return getattr(now, kind) - getattr(before, kind), all_now - all_before

    def _share(self, kind: str, limit: float, remedy: str) -> Finding:
        if not self._counts:
            return Finding.unknown(self._no_stream)
        count, images = self._recent(kind)
        wrong = images >= _FEWEST and count > limit * images
        return Finding.from_value(
            count, 0, "", f"{count} of {images} images {remedy}" if wrong else ""
        )


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
            saturated=gel.judge_saturation(),
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
