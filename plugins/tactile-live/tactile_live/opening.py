"""Opens what the page shows: a sensor, or a recording that is played."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.places import default_place
from tactile_core.errors import InputError
from tactile_core.interfaces.component import HAND_CAMERA, VIRTUAL_CAMERA
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.plugins.options import calibrator_of
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile

T = TypeVar("T")


@dataclass(frozen=True)
class WantedSensor:
    """One sensor of a page, as the user gave it."""

    profile: str
    serial: str | None = None
    input: Path | None = None
    reference: str | None = None
    bundle: Path | None = None


def wanted_sensors(
    profiles: Sequence[str],
    *,
    serials: Sequence[str] = (),
    inputs: Sequence[Path] = (),
    references: Sequence[str] = (),
    bundles: Sequence[Path] = (),
) -> list[WantedSensor]:
    """Return the sensors of a page.

    What is given once holds for all of them; what is given several times is one per sensor.

    Raises
    ------
    InputError
        Two of these are given several times, but not equally often; or the same unit twice.
    """
    count = max(map(len, (profiles, serials, inputs, references, bundles)))
    columns = [
        _spread("profiles", profiles, count),
        _spread("--serial", serials, count),
        _spread("--input", inputs, count),
        _spread("--reference", references, count),
        _spread("--bundle", bundles, count),
    ]
    wanted = [
        WantedSensor(str(profile), serial, input, reference, bundle)
        for profile, serial, input, reference, bundle in zip(*columns, strict=True)
        if profile is not None
    ]
    named = [(one.profile, one.serial) for one in wanted if one.serial and not one.input]
    if len(set(named)) < len(named):
        raise InputError("a unit is named twice; give each --serial once")
    return wanted


def open_live(
    wanted: WantedSensor,
    *,
    gel: str | None = None,
    sim: bool = False,
    script: Path | None = None,
    timeout_s: float = 1.0,
    reconnect_s: float = 0.0,
    say: Callable[[str], None] = lambda words: None,
) -> Sensor:
    """Open a sensor for the live page.

    A virtual sensor without a script has a hand that moves an object on it, unless its profile has
    a virtual camera of its own. Without a bundle, it is calibrated first, by virtual presses.

    Parameters
    ----------
    say : callable
        Receives a sentence about work that takes seconds.

    Raises
    ------
    TactileError
        As :func:`~tactile_core.pipeline.opening.open_sensor`.
    """
    if wanted.input is not None and sim:
        raise InputError("--input and --sim exclude each other; give one of them")
    bundle: Bundle | Path | None = wanted.bundle
    profile: Profile | str = wanted.profile
    if sim and script is None:
        profile = load_profile(wanted.profile, sim=True)
        if profile.camera.use == VIRTUAL_CAMERA:
            resolve("camera", HAND_CAMERA)  # its error names the distribution
            hand = {"camera": {"use": HAND_CAMERA}}
            profile = load_profile(wanted.profile, sim=True, overrides=hand)
        own = default_place(profile, wanted.serial, gel).is_dir()
        if bundle is None and not own and not calibrator_of(profile.calibration).refusal:
            bundle = _virtual_bundle(profile, say)
    return open_sensor(
        profile,
        serial=wanted.serial,
        gel=gel,
        bundle=bundle,
        input=wanted.input,
        reference=wanted.reference,
        sim=sim,
        script=script,
        timeout_s=timeout_s,
        reconnect_s=reconnect_s,
    )


def _virtual_bundle(profile: Profile, say: Callable[[str], None]) -> Bundle:
    from tactile_core.calibration.virtual_unit import calibrate_virtual_unit

    say(f"calibrating the virtual {profile.name}, which takes some seconds")
    return calibrate_virtual_unit(profile)


def _spread(what: str, given: Sequence[T], count: int) -> list[T | None]:
    if len(given) not in (0, 1, count):
        raise InputError(
            f"there are {len(given)} {what} for {count} sensors; give one for all of them, or one "
            f"for each"
        )
    if not given:
        return [None] * count
    return [*given] * (count if len(given) == 1 else 1)


@dataclass(frozen=True)
class PlaybackState:
    """How a recording is played.

    Attributes
    ----------
    paused, loop : bool
    speed : float
        1 is the recording's own; 0 is as fast as the sensor measures.
    ended : bool
        Whether the last observation was played.
    """

    paused: bool = False
    loop: bool = True
    speed: float = 1.0
    ended: bool = False

    def describe_state(self) -> dict[str, Any]:
        """Return it as JSON-ready values."""
        return dict(vars(self))


class ShownPlayback:
    """Decides when the next observation of a recording is due.

    Only the thread that measures uses it.
    """

    def __init__(self) -> None:
        self.state = PlaybackState()
        self._steps = 0
        self._anchor: tuple[float, float] | None = None

    @property
    def waits(self) -> bool:
        """Whether the next observation has to wait for the user."""
        return self.state.ended or (self.state.paused and not self._steps)

    def play(
        self,
        *,
        paused: bool | None = None,
        loop: bool | None = None,
        speed: float | None = None,
        step: bool = False,
    ) -> bool:
        """Change how it is played; return whether it has to be rewound first."""
        given = {"paused": paused, "loop": loop, "speed": speed}
        rewind = self.state.ended and (step or paused is False or loop is True)
        changes: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
        if step:
            changes["paused"], self._steps = True, 1
        self.state = replace(self.state, **changes, ended=self.state.ended and not rewind)
        self._anchor = None
        return rewind

    def end(self) -> bool:
        """Note that the recording has ended; return whether it has to be rewound now."""
        self._anchor = None
        self.state = replace(self.state, ended=not self.state.loop)
        return self.state.loop

    def wait_s(self, timestamp_s: float, now_s: float) -> float:
        """Return how long the observation of this timestamp must still wait, s."""
        if self._steps or not self.state.speed:
            return 0.0
        if self._anchor is None or timestamp_s < self._anchor[0]:
            self._anchor = (timestamp_s, now_s)
        begin_s, began_s = self._anchor
        due_s = began_s + (timestamp_s - begin_s) / self.state.speed
        if due_s < now_s - 1.0:  # too slow for this speed: go on from here, without a rush
            self._anchor = (timestamp_s, now_s)
        return max(0.0, due_s - now_s)

    def note_observation(self) -> None:
        """Note that an observation was shown."""
        self._steps = 0
