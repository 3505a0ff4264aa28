"""A box of LEDs that speaks the light protocol, and is kept alive."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from threading import Event, Lock, Thread
from typing import Protocol, Self

from pydantic import Field, model_validator

from tactile_core.errors import DeviceAbsent, DeviceError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.light_driver import LightDriver

VERSION = 1  # Version of the protocol

NAME = "tactile-lights"  # First word by which a box says what it is

FULL = 255  # Level of full brightness

UNASKED = 0  # Number of an answer to no request, or to one whose number was unreadable

_POLYNOMIAL, _TOP_BIT, _BYTE = 0x07, 0x80, 0xFF


class LineError(ValueError):
    """A line is not one of the protocol, or was damaged on its way."""


def checksum(payload: bytes) -> int:
    """CRC-8 with the polynomial x⁸ + x² + x + 1, from 0."""
    total = 0
    for byte in payload:
        total ^= byte
        for _ in range(8):
            total = (total << 1 ^ _POLYNOMIAL if total & _TOP_BIT else total << 1) & _BYTE
    return total


def encode(*words: str | int) -> bytes:
    """Make a line from its words.

    It begins with an end of line as well, so that a damaged end of the previous line costs that
    line only.
    """
    payload = " ".join(map(str, words)).encode("ascii")
    return b"\n%s*%02X\n" % (payload, checksum(payload))


def decode(line: bytes) -> tuple[str, ...]:
    """Return the words of a received line.

    Raises
    ------
    LineError
        It is damaged, or not of this protocol.
    """
    payload, star, digits = line.strip().rpartition(b"*")
    try:
        expected = int(digits, 16)
        words = tuple(payload.decode("ascii").split())
    except ValueError as error:
        raise LineError(f"{line!r} is not of the light protocol") from error
    if not (star and words) or expected != checksum(payload):
        raise LineError(f"{line!r} has the wrong checksum")
    return words


@dataclass(frozen=True)
class BoxInfo:
    """How a box describes itself.

    Attributes
    ----------
    firmware : str
        Version of its firmware.
    serial : str
        Serial number of the box.
    lights : int
        Number of outputs.
    settle_s, watchdog_s : float
        Time that a light takes to settle, and time without a request after which all lights go out.
    """

    firmware: str
    serial: str
    lights: int
    settle_s: float
    watchdog_s: float

    @classmethod
    def from_words(cls, words: Sequence[str]) -> Self:
        """Read the words of a description.

        Raises
        ------
        LineError
            They describe something else, or a box with another version of the protocol.
        """
        version, name, *rest = (*words, "", "")
        if name != NAME:
            raise LineError(f"describes itself as {' '.join(words)!r}, not as {NAME!r}")
        if version != str(VERSION):
            raise LineError(
                f"speaks version {version} of the light protocol instead of {VERSION}; upload the "
                f"firmware that belongs to this version of tactile-core"
            )
        try:
            firmware, serial, lights, settle_ms, watchdog_ms = rest[:5]
            return cls(firmware, serial, int(lights), int(settle_ms) / 1e3, int(watchdog_ms) / 1e3)
        except ValueError as error:
            raise LineError(f"describes itself incompletely, as {' '.join(words)!r}") from error


class KeepAlive:
    """Calls a function at an interval from construction until :meth:`stop`.

    Parameters
    ----------
    beat : callable
        May raise :class:`~tactile_core.errors.DeviceError`, which :meth:`check` raises again. The
        function is still called thereafter: the box may respond again.
    interval_s : float
    """

    def __init__(self, beat: Callable[[], None], interval_s: float) -> None:
        self._beat = beat
        self._interval_s = interval_s
        self._stopped = Event()
        self._fault: DeviceError | None = None
        self._thread = Thread(target=self._run, name="keep-alive of the lights", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Raise the error of the latest failed call, once.

        Raises
        ------
        DeviceError
            The box did not respond since the last check.
        """
        fault, self._fault = self._fault, None
        if fault is not None:
            raise fault

    def stop(self) -> None:
        """End the thread and wait for it; as long as one call takes at most."""
        self._stopped.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopped.wait(self._interval_s):
            try:
                self._beat()
            except DeviceError as error:
                self._fault = error


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
        # [requests] three may be late or lost before the lights go out
        self._alive = KeepAlive(self._beat, link.info.watchdog_s / 4)

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
