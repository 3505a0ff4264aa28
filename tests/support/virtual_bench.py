"""A camera and its lights on a virtual clock, simulated event by event.

Each image is what the lights were while each of its rows was exposed, so that it shows whether it
was taken under its own light.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tactile_core.acquisition.free_running import HOST, Clock
from tactile_core.errors import CameraTimeout, DeviceError
from tactile_core.interfaces.camera import Camera, Trigger
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination
from tactile_core.interfaces.image import ImageSection
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.quantities import Image

LIGHTS = tuple(f"led{number}" for number in range(1, 7))
ROWS, COLUMNS = 16, 20
IMAGE = ImageSection(width_px=COLUMNS, height_px=ROWS, mm_per_px=0.1, color="grey")
_Y, _X = np.mgrid[-1 : 1 : ROWS * 1j, -1 : 1 : COLUMNS * 1j]
_AZIMUTH = np.arange(6) * np.pi / 3
AMBIENT = 10.0
BUFFERS = 4
RECENT = 50
"""Changes of light that can be within one exposure."""
BRIGHT = 110 + 60 * (np.cos(_AZIMUTH)[:, None, None] * _X + np.sin(_AZIMUTH)[:, None, None] * _Y)
"""(6, ROWS, COLUMNS) image of each light."""


class SixLights(Illumination):
    """Six lights one after another, and a dark exposure if ``dark``."""

    channels = LIGHTS

    def __init__(self, *, dark: bool = False, times_s: Mapping[str, float] | None = None) -> None:
        super().__init__(Options())
        times = times_s or {}
        lit = tuple(Exposure({one: 1.0}, (one,), times.get(one)) for one in LIGHTS)
        self._exposures = (*lit, Exposure({}, ())) if dark else lit

    def exposures(self) -> tuple[Exposure, ...]:
        return self._exposures


class VirtualTime:
    """Time that passes only when somebody waits."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.clock = Clock(lambda: self.now_s, self.sleep)

    def sleep(self, duration_s: float) -> None:
        self.now_s += duration_s


class RealTime(VirtualTime):
    """The time of the host."""

    def __init__(self) -> None:
        self.clock = HOST

    @property
    def now_s(self) -> float:  # type: ignore[override]
        return HOST.now()

    def sleep(self, duration_s: float) -> None:
        HOST.sleep(duration_s)


class Scene:
    """What the lights did, and what a camera sees of it.

    Attributes
    ----------
    changes : list of (float, (6,) array)
        When the lights changed, s, and their levels since.
    """

    def __init__(self) -> None:
        self.changes: list[tuple[float, np.ndarray]] = [(0.0, np.zeros(len(LIGHTS)))]

    def picture(self, begin_s: np.ndarray, exposure_s: float) -> np.ndarray:
        """Return the image whose rows are exposed from ``begin_s`` on."""
        changes = self.changes[-RECENT:]
        times = np.array([-np.inf, *(time for time, _ in changes[1:]), np.inf])
        total = np.full((ROWS, COLUMNS), AMBIENT)
        for number, (_, levels) in enumerate(changes):
            on = np.maximum(times[number], begin_s)
            off = np.minimum(times[number + 1], begin_s + exposure_s)
            share = np.maximum(off - on, 0) / exposure_s
            if share.any():
                total += share[:, None] * np.tensordot(levels, BRIGHT, 1)
        return np.rint(total).astype(np.uint8)


class VirtualLights(LightDriver):
    """Lights that change some time after the request, and before its acknowledgement.

    Attributes
    ----------
    latency_s : float
        From the request to its acknowledgement, on average.
    swapped : dict
        The light that shines instead of one that was asked for, for a fault.
    silent : bool
        Whether the box no longer answers.
    """

    def __init__(self, time: VirtualTime, latency_s: float = 0.003) -> None:
        super().__init__(Options())
        self._time, self.latency_s = time, latency_s
        self._random = np.random.default_rng(1)
        self.scene = Scene()
        self.swapped: dict[str, str] = {}
        self.silent = False

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _set(self, levels: Mapping[str, float]) -> None:
        if self.silent:
            self._time.sleep(0.5)
            raise DeviceError("the light box does not answer")
        latency_s = self.latency_s * self._random.uniform(0.7, 1.3)
        self._time.sleep(self._random.uniform(0.2, 1.0) * latency_s)
        on = [self.swapped.get(name, name) for name in levels]
        values = np.zeros(len(LIGHTS))
        for name, level in zip(on, levels.values(), strict=True):
            values[LIGHTS.index(name)] = level
        self.scene.changes.append((self._time.now_s, values))
        self._time.sleep(0.3 * latency_s)


@dataclass(frozen=True)
class Timing:
    """Of a camera, s.

    Attributes
    ----------
    readout_s : float
        From the first row to the last.
    rolling : bool
        Whether rows are exposed one after another, as they are read out.
    transfer_s : float
        From the end of the readout to the program, on average.
    stamp_s : float
        From the beginning of the first row's exposure to the timestamp.
    jitter_s : float
        Of timestamps; of the transfer it is five times as much.
    """

    period_s: float = 1 / 30
    exposure_s: float = 0.01
    readout_s: float = 0.028
    rolling: bool = True
    transfer_s: float = 0.006
    stamp_s: float = 0.011
    jitter_s: float = 0.001

    @property
    def latest_stamp_s(self) -> float:
        return self.stamp_s + self.jitter_s


class VirtualCamera(Camera):
    """A camera that runs freely, with a queue of four buffers; when it is full, images are lost."""

    def __init__(
        self, time: VirtualTime, scene: Scene, timing: Timing, *, knows: bool = False
    ) -> None:
        super().__init__(Options())
        self._time, self._scene, self.timing = time, scene, timing
        self._random = np.random.default_rng(2)
        self._late = self._random.random(997)
        self._queue: deque[tuple[int, float, float, float]] = deque()
        self._number = 0
        self._began_s = 0.0
        self._exposure_s = timing.exposure_s
        self._knows = knows
        self.reports = True
        self.latency_of_settings = 2
        self._settings: list[tuple[int, float]] = []

    @property
    def stamp_delay_s(self) -> float | None:
        return self.timing.latest_stamp_s if self._knows else None

    def _open(self) -> None:
        self._began_s = self._time.now_s

    def _close(self) -> None:
        """Nothing to release."""

    def _arm(self, exposures: tuple[Exposure, ...]) -> Trigger:
        return Trigger.FREE_RUNNING

    def _prepare(self, exposure: Exposure) -> None:
        if exposure.exposure_time_s is not None:
            now = int((self._time.now_s - self._began_s) / self.timing.period_s)
            self._settings.append((now + self.latency_of_settings, exposure.exposure_time_s))

    def _exposure_of(self, number: int) -> float:
        begun = [exposure_s for since, exposure_s in self._settings if since <= number]
        return begun[-1] if begun else self.timing.exposure_s

    def _arrival_s(self) -> float:
        """Time at which the next image arrives."""
        one = self.timing
        late_s = one.transfer_s + 5 * one.jitter_s * self._late[self._number % len(self._late)]
        begin_s = self._began_s + self._number * one.period_s
        return begin_s + self._exposure_of(self._number) + one.readout_s + late_s

    def _fill(self) -> None:
        """Queue the images that have arrived."""
        one = self.timing
        while self._arrival_s() <= self._time.now_s:
            if len(self._queue) < BUFFERS:
                begin_s = self._began_s + self._number * one.period_s
                stamp_s = begin_s + one.stamp_s + one.jitter_s * self._random.uniform(-1, 1)
                exposure_s = self._exposure_of(self._number)
                self._queue.append((self._number, begin_s, exposure_s, stamp_s))
            self._number += 1

    def _read(self, timeout_s: float) -> Image:
        until_s = self._time.now_s + timeout_s
        self._fill()
        if not self._queue:
            self._time.sleep(max(min(self._arrival_s(), until_s) - self._time.now_s, 0.0))
            self._fill()
        if not self._queue:
            raise CameraTimeout("no image")
        number, begin_s, exposure_s, stamp_s = self._queue.popleft()
        rows_s = np.linspace(0, self.timing.readout_s, ROWS) if self.timing.rolling else 0.0
        pixels = self._scene.picture(begin_s + rows_s * np.ones(ROWS), exposure_s)
        return Image(
            pixels,
            stamp_s,
            stamp_s,
            number,
            exposure_time_s=exposure_s if self.reports else None,
        )


class TriggeredCamera(Camera):
    """A camera with a software trigger; ``overlaps`` if it says when an exposure has ended."""

    def __init__(self, time: VirtualTime, scene: Scene, timing: Timing, *, overlaps: bool) -> None:
        super().__init__(Options())
        self._time, self._scene, self.timing, self._overlaps = time, scene, timing, overlaps
        self._ended: tuple[float, np.ndarray] | None = None

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _take(self) -> None:
        begin_s = self._time.now_s
        self._time.sleep(self.timing.exposure_s)
        self._ended = begin_s, self._scene.picture(np.full(ROWS, begin_s), self.timing.exposure_s)

    def _expose(self, timeout_s: float) -> bool:
        if self._overlaps:
            self._take()
        return self._overlaps

    def _read(self, timeout_s: float) -> Image:
        if self._ended is None:
            self._take()
        assert self._ended is not None
        (begin_s, pixels), self._ended = self._ended, None
        done_s = begin_s + self.timing.exposure_s + self.timing.readout_s
        self._time.sleep(max(done_s - self._time.now_s, 0))
        return Image(pixels, begin_s + self.timing.exposure_s / 2)
