"""``core.serial_leds`` and ``core.uvc_leds``: lights behind a serial port or a camera's control."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, Self

from pydantic import BaseModel, Field, model_validator

from tactile_core.builtin.leds.led_box import LedBox, Link
from tactile_core.builtin.leds.serial_link import (
    SerialLink,
    SerialOptions,
    find_port,
    open_port,
    usb_ports,
)
from tactile_core.errors import DeviceError, LibraryMissing
from tactile_core.interfaces.camera import Camera, ControlledCamera
from tactile_core.interfaces.device import ConnectedDevice, Options
from tactile_core.interfaces.light_driver import LightDriver


class SerialLeds(LedBox):
    """Sets the lights of a box with the light protocol over a serial port.

    Opening takes as long as an Arduino takes to start, at most 4 s. A box that does not answer is
    an error after ``timeout_s``.
    """

    Options: ClassVar[type[BaseModel]] = SerialOptions
    selectors: ClassVar[Mapping[str, str]] = {
        "usb_id": "usb_id",
        "usb_serial": "serial",
        "port_path": "port_path",
        "port": "place",
    }

    def __init__(self, options: SerialOptions) -> None:
        super().__init__(options)
        self._where = options

    @classmethod
    def connected(cls) -> Iterator[ConnectedDevice]:
        """Yield every USB serial port: asking which is a box would restart an Arduino."""
        _require_library()
        return usb_ports()

    def _connect(self) -> Link:
        _require_library()
        name, timeout_s = find_port(self._where), self._where.timeout_s
        return SerialLink(open_port(name, timeout_s), name, timeout_s)


def _require_library() -> None:
    try:
        import serial  # noqa: F401
    except ImportError as error:
        raise LibraryMissing(
            "core.serial_leds needs pyserial; run: pip install 'tactile-core[serial]'"
        ) from error


_WIDEST = 31  # Bits of a control; UVC's are signed integers of 32 bits at most


class UvcLedOptions(Options):
    """Options of ``core.uvc_leds``."""

    lights: tuple[str, ...] = Field(
        min_length=1, description="Names of the lights, from the highest bits to the lowest."
    )
    control: str = Field(default="zoom", description="The camera's control that sets the lights.")
    bits: int = Field(default=4, ge=1, le=16, description="Bits for each light.")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if len(set(self.lights)) < len(self.lights):
            raise ValueError("two lights have the same name; give each its own")
        if self.bits * len(self.lights) > _WIDEST:
            raise ValueError(
                f"{len(self.lights)} lights of {self.bits} bits do not fit into a control of "
                f"{_WIDEST} bits"
            )
        return self


class UvcLeds(LightDriver):
    """Sets lights through a control of the camera, as DIGIT does with its zoom.

    The levels of all lights are one number, with ``bits`` for each light. Such a camera has no
    watchdog: when the program is killed, the lights stay on until the next one sets them.
    """

    Options: ClassVar[type[BaseModel]] = UvcLedOptions

    def __init__(self, options: UvcLedOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._camera: ControlledCamera | None = None

    def attach(self, camera: Camera) -> None:
        """Receive the camera.

        Raises
        ------
        DeviceError
            It has no controls.
        """
        if not isinstance(camera, ControlledCamera):
            raise DeviceError(
                f"core.uvc_leds sets lights through a control of the camera, but "
                f"{type(camera).__name__} has none; use core.uvc, or another light driver"
            )
        self._camera = camera

    def _open(self) -> None:
        """Do nothing: the camera is opened later."""

    def _close(self) -> None:
        """Do nothing: the control is the camera's."""

    def _set(self, levels: Mapping[str, float]) -> None:
        camera, name = self._camera, self._settings.control
        if not levels and (camera is None or not camera.is_open):
            return  # a sensor darkens the lights before it closes the camera
        if camera is None:
            raise DeviceError("core.uvc_leds has no camera; attach() the one of the lights first")
        # what is read back proves nothing: a DIGIT takes 4095 and reports its zoom as 255
        camera.set_control(name, self._value(levels))

    def _value(self, levels: Mapping[str, float]) -> int:
        """Return the control's value; a light that is on is at least at level 1."""
        names, full = self._settings.lights, (1 << self._settings.bits) - 1
        unknown = [name for name in levels if name not in names]
        if unknown:
            raise DeviceError(
                f"the camera has no light {unknown[0]!r}; its lights are {', '.join(names)}"
            )
        value = 0
        for name in names:
            level = levels.get(name, 0.0)
            value = value << self._settings.bits | (max(1, round(full * level)) if level else 0)
        return value
