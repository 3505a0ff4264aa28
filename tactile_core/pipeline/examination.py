"""Examines an installation and a sensor, part by part, and says what to do about each."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, Literal

from tactile_core.acquisition.devices import CAMERA, DRIVER, make_devices
from tactile_core.acquisition.unit_devices import shared_hubs, with_unit_devices
from tactile_core.conditioning.conditioning import is_sequential
from tactile_core.errors import (
    BandwidthError,
    DeviceAbsent,
    DeviceBusy,
    DeviceError,
    DeviceForbidden,
    LibraryMissing,
    SequenceError,
    TactileError,
)
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Device
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.pipeline.health import Finding, Health
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.parts import check_steps
from tactile_core.pipeline.sensor import TIMEOUT_S, Sensor
from tactile_core.plugins.blame import blame
from tactile_core.plugins.entry_points import opencv_fault
from tactile_core.plugins.registry import list_plugins, origin_of
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import ShownGel

# What must be right before a device is open, in this order, and the error if it is not.
_STAGES: tuple[tuple[str, type[DeviceError]], ...] = (
    ("library", LibraryMissing),
    ("found", DeviceAbsent),
    ("permission", DeviceForbidden),
    ("not busy", DeviceBusy),
    ("bandwidth", BandwidthError),
)

_NOT_OPEN = "it is not open, because of the problem above"


_READS_S = 2.5  # Time for which a live sensor is read: the rate is measured over two seconds


@dataclass(frozen=True)
class Check:
    """The result for one part.

    Attributes
    ----------
    part : str
    verdict : {"ok", "problem", "unknown"}
    message : str
        For a problem what to do, else what is known or why it is not; may be empty.
    exit_code : int
        Of the command: 2 if something that the user gave is unusable, 1 if a device fails.
    """

    part: str
    verdict: Literal["ok", "problem", "unknown"]
    message: str = ""
    exit_code: int = 0


def examine_plugins() -> Iterator[Check]:
    """Look at OpenCV's packages, and import every installed plugin and its components."""
    fault = opencv_fault()
    yield Check("opencv", *(("problem", fault, 2) if fault else ("ok",)))
    for plugin in list_plugins(import_components=True):
        problems = "; ".join(plugin.problems)
        yield Check(f"plugin {plugin.name}", *(("problem", problems, 2) if problems else ("ok",)))


def examine(
    profile: str | Path,
    *,
    sim: bool = False,
    input: Path | None = None,
    **options: Any,
) -> Iterator[Check]:
    """Examine a sensor: its profile, its devices, and what it measures.

    Parameters
    ----------
    profile : str or Path
    sim, input, **options
        As for :func:`~tactile_core.pipeline.opening.open_sensor`. Devices are opened only without a
        virtual sensor and a recording.

    Yields
    ------
    Check
        In the order in which the parts depend on each other. After a problem that prevents it,
        a part is unknown.

    Raises
    ------
    ProfileError, PluginError, CalibrationError, InputError
        An argument is unusable.
    """
    loaded = load_profile(profile, sim=sim)
    check_steps(loaded)
    yield Check(f"profile {profile}", "ok")
    if not (sim or input):
        if options.get("serial") is not None:
            loaded = with_unit_devices(loaded, options["serial"])
        devices = list(_examine_devices(loaded, options.get("timeout_s", TIMEOUT_S)))
        yield from devices
        if any(check.part == "camera" for check in devices):
            return
        if any(check.verdict == "problem" for check in devices):
            yield Check("observation", "unknown", _NOT_OPEN)
            return
    try:
        with open_sensor(profile, sim=sim, input=input, **options) as sensor:
            yield from _examine_readings(sensor)
    except SequenceError as error:
        yield Check("lights in order", "problem", str(error), 1)
    except DeviceError as error:
        yield Check("observation", "problem", str(error), error.exit_code)


def _examine_devices(profile: Profile, timeout_s: float) -> Iterator[Check]:
    try:
        camera, illumination, driver = make_devices(profile)
    except DeviceError as error:
        yield Check("camera library", "problem", str(error), error.exit_code)
        return
    if not camera.live:
        where = origin_of(camera)
        yield Check(
            "camera", "unknown", f"{where} opens no device; give a recording with --input, or --sim"
        )
        return
    try:
        is_open = yield from _open_device("camera", CAMERA, camera)
        if is_open:
            yield from _bandwidth(camera, timeout_s)
        if driver is None:
            yield Check("lights", "unknown", "the profile names no driver, so nothing sets them")
            return
        with blame(DRIVER, driver):
            driver.attach(camera)
        if (yield from _open_device("lights", DRIVER, driver)):
            yield from _examine_lights(driver, is_open)
            if is_open:
                levels = {name: 1.0 for one in illumination.exposures() for name in one.levels}
                yield from _examine_light(camera, driver, levels, timeout_s)
    finally:
        for device in (driver, camera):
            with suppress(TactileError):  # it has failed before, which was said
                if device is not None:
                    device.close()


def _open_device(name: str, part: str, device: Device) -> Generator[Check, None, bool]:
    """Open a device, yield a check for each stage of it, and return whether it is open."""
    try:
        with blame(part, device):
            device.open()
    except TactileError as error:
        yield from _stages(name, error)
        return False
    unit = device.device_id if isinstance(device, Camera) else ""
    for stage, _ in _STAGES[:-1]:
        yield Check(f"{name} {stage}", "ok", unit if stage == "found" else "")
    return True


def _stages(name: str, error: TactileError) -> Iterator[Check]:
    kinds = [isinstance(error, kind) for _, kind in _STAGES]
    failed = kinds.index(True) if any(kinds) else None
    stages = _STAGES if name == "camera" else _STAGES[:-1]
    for number, (stage, _) in enumerate(stages):
        part = f"{name} {stage}"
        if number == failed:
            yield Check(part, "problem", str(error), error.exit_code)
        elif failed is not None and number < failed:
            yield Check(part, "ok")
        else:
            yield Check(part, "unknown", "" if failed is None else _NOT_OPEN)
    if failed is None:
        yield Check(f"{name} opens", "problem", str(error), error.exit_code)


def _bandwidth(camera: Camera, timeout_s: float) -> Iterator[Check]:
    try:
        with blame(CAMERA, camera):
            camera.read(timeout_s)
    except TactileError as error:
        yield Check("camera bandwidth", "problem", f"{error}{_sharing(camera)}", error.exit_code)
    else:
        yield Check("camera bandwidth", "ok", _sharing(camera).removeprefix("; "))


def _sharing(camera: Camera) -> str:
    """Say which cameras of its kind share a hub, as far as that is known."""
    ports: list[str] = []
    with suppress(TactileError):  # a library is missing
        ports.extend(one.port_path for one in type(camera).connected() if one.port_path)
    return "".join(
        f"; the cameras at {' and '.join(together)} share the hub {hub}"
        for hub, together in sorted(shared_hubs(ports).items())
    )


def _examine_lights(driver: LightDriver, camera_is_open: bool) -> Iterator[Check]:
    try:
        with blame(DRIVER, driver):
            watchdog_s = driver.watchdog_s
            driver.set({})
    except TactileError as error:
        yield Check("lights answer", "problem", str(error), error.exit_code)
        return
    # lights that hang on a camera answer only through it
    answers = camera_is_open or watchdog_s is not None
    yield Check("lights answer", "ok" if answers else "unknown", "" if answers else _NOT_OPEN)
    if watchdog_s is not None:
        words = f"the lights go out {watchdog_s:g} s after the program is killed"
    else:
        words = (
            "there is none: lights stay on when the program is killed (kill -9), until the sensor "
            "is opened again, which switches them off first"
        )
    yield Check("lights watchdog", "ok", words)


def _examine_light(
    camera: Camera, driver: LightDriver, levels: Mapping[str, float], timeout_s: float
) -> Iterator[Check]:
    """Judge the lights by the images: what a driver or a control answers proves little."""
    means = []
    try:
        for shining in ({}, levels, {}):
            with blame(DRIVER, driver):
                driver.set(shining)
            with blame(CAMERA, camera):
                *_, last = [camera.read(timeout_s) for _ in range(6)]  # drivers buffer four
            means.append(0.0 if last is None else float(last.pixels.mean()))
    except TactileError as error:
        yield Check("lights shine", "problem", str(error), error.exit_code)
        return
    off, on = max(means[0], means[2]), means[1]
    if on > 1.1 * off:  # light drifts by a tenth at most
        yield Check(
            "lights shine", "ok", f"the image has {on:.0f} counts with them, {off:.0f} without"
        )
    else:
        words = (
            f"the image has {off:.0f} counts without the lights and {on:.0f} with them; "
            f"check their supply and the driver's options, keep daylight out, and lock the exposure"
        )
        yield Check("lights shine", "problem", words, 1)


def _examine_readings(sensor: Sensor) -> Iterator[Check]:
    reading, until_s = sensor.read(), monotonic() + _READS_S
    while sensor.is_live and monotonic() < until_s:
        reading = sensor.read()
    height, width, channels = reading.frame.pixels.shape
    yield Check("observation", "ok", f"{width} × {height}, {channels} channels")
    if is_sequential(reading.frame):
        # an observation with another light than its own raises an error when it is read
        yield Check("lights in order", "ok")
    if sensor.pipeline.reference is None:
        yield Check("reference", "unknown", "there is none; give --reference or --bundle")
    else:
        yield Check("reference", "ok")
    shown = reading.get(ShownGel)
    if shown is not None and shown.this_gel:
        yield Check("shows the gel", "ok")
    elif shown is not None:
        yield Check("shows the gel", "problem", shown.advice, 1)
    drift, too_far = sensor.pipeline.drift(reading.frame)
    if drift:
        yield Check("light since calibration", "problem" if too_far else "ok", drift, 1)
    health = sensor.health()
    yield from _of_health(health)
    said = {*health.warnings, *sensor.notes, *(shown.warnings() if shown is not None else ())}
    for words in (*sensor.notes, *(one for one in reading.warnings if one not in said)):
        yield Check("note", "unknown", words)


def _of_health(health: Health) -> Iterator[Check]:
    for name, found in health.findings():
        part = name.replace("_", " ")
        if found.verdict == "warning":
            yield Check(part, "problem", found.message, 1)
        else:
            yield Check(part, found.verdict, found.message or quantity_text(found))


def quantity_text(found: Finding) -> str:
    """Return a finding's value in words, such as ``29.9 of 30 Hz``."""
    if found.value is None:
        return ""
    of = f" of {found.expected:.3g}" if found.expected else ""
    return f"{found.value:.3g}{of} {found.unit}".rstrip()


def exit_code_of(checks: Iterable[Check]) -> int:
    """Return the exit code of the command for these checks."""
    return max((check.exit_code for check in checks if check.verdict == "problem"), default=0)
