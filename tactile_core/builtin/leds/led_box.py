"""What boxes of LEDs have in common, at whatever port: outputs, a watchdog, a serial number."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from threading import Lock
from typing import Protocol, Self

from pydantic import Field, model_validator

from tactile_core.builtin.leds.keep_alive import KeepAlive
from tactile_core.builtin.leds.protocol import FULL, BoxInfo
from tactile_core.errors import DeviceAbsent, DeviceError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.light_driver import LightDriver


class BOX:
    """How a box is kept alive."""

    # [count] Requests within the time of the box's watchdog. Source: three may be late or lost
    # before the lights go out.
    beats_per_watchdog = 4


class BoxOptions(Options):
    """Options of every box."""

    lights: tuple[str, ...] = Field(
        min_length=1, description="Name of the light at each output of the box, in order."
    )
    serial: str | None = Field(
        default=None, description="Serial number that the box must report. Default: any."
    )
    timeout_s: float = Field(
        default=0.5, gt=0, le=5, description="Longest wait for an acknowledgement, s."
    )

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        if len(set(self.lights)) < len(self.lights):
            raise ValueError("two outputs have the same light; give each its own name")
        return self


class Link(Protocol):
    """A connection to a box that has described itself.

    ``set_levels`` and ``keep_alive`` return once the box has acknowledged, and raise
    :class:`~tactile_core.errors.DeviceError` if it does not in time.
    """

    @property
    def info(self) -> BoxInfo:
        """How the box describes itself."""

    @property
    def place(self) -> str:
        """Where it is connected, for messages."""

    def set_levels(self, levels: bytes) -> None:
        """Set the level of each output."""

    def keep_alive(self) -> None:
        """Keep the lights on."""

    def close(self) -> None:
        """Release the port; must not raise."""


class LedBox(LightDriver):
    """Drives a box of LEDs; implement ``_connect``.

    A thread keeps the box alive. If this program ends or is killed, the box's watchdog switches
    the lights off.
    """

    def __init__(self, options: BoxOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._link: Link | None = None
        self._lock = Lock()
        self._alive: KeepAlive | None = None
        self._failed = False

    @property
    def info(self) -> BoxInfo | None:
        """How the box describes itself; None while it is closed."""
        return None if self._link is None else self._link.info

    @property
    def watchdog_s(self) -> float | None:
        """Time after which the box switches the lights off by itself, s."""
        return None if self.info is None else self.info.watchdog_s

    @abstractmethod
    def _connect(self) -> Link:
        """Find the box and connect to it; if that fails, leave nothing open."""

    def _open(self) -> None:
        self._failed = False
        self._link = link = self._connect()
        _require(link.info, self._settings, link.place)
        link.set_levels(bytes(link.info.lights))  # what an earlier program left on
        self._alive = KeepAlive(self._beat, link.info.watchdog_s / BOX.beats_per_watchdog)

    def _close(self) -> None:
        alive, self._alive = self._alive, None
        if alive is not None:
            alive.stop()
        link, self._link = self._link, None
        if link is not None:
            link.close()

    def _set(self, levels: Mapping[str, float]) -> None:
        if self._failed and not levels:
            return  # the failure is known, and the watchdog switches the lights off
        outputs = _outputs(levels, self._settings.lights)
        self._check()
        with self._lock:
            assert self._link is not None
            try:
                self._link.set_levels(outputs)
            except DeviceError:
                self._failed = True
                raise
        self._failed = False

    def _check(self) -> None:
        if self._alive is None:
            return
        try:
            self._alive.check()
        except DeviceError:
            self._failed = True
            raise

    def _beat(self) -> None:
        with self._lock:
            if self._link is not None:
                self._link.keep_alive()


def _outputs(levels: Mapping[str, float], names: tuple[str, ...]) -> bytes:
    """Return the level of each output, 0..255; a light that is on is at least at level 1."""
    unknown = [name for name in levels if name not in names]
    if unknown:
        raise DeviceError(
            f"the light box has no light {unknown[0]!r}; its lights are {', '.join(names)}: name "
            f"them in the profile's 'illumination.driver.lights' like those of 'illumination'"
        )
    values = (levels.get(name, 0.0) for name in names)
    return bytes(max(1, round(FULL * value)) if value > 0 else 0 for value in values)


def _require(info: BoxInfo, options: BoxOptions, place: str) -> None:
    """Refuse another unit's box, and one with another number of lights."""
    if options.serial not in (None, info.serial):
        raise DeviceAbsent(
            f"the light box at {place} has the serial number {info.serial!r} instead of "
            f"{options.serial!r}; plug in the right one, or correct 'serial' of the light driver"
        )
    if info.lights != len(options.lights):
        raise DeviceError(
            f"the light box at {place} has {info.lights} lights, but 'lights' of the light driver "
            f"names {len(options.lights)}; name one for each output"
        )
