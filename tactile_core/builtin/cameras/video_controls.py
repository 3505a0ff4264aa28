"""Settings of a camera that must not change by themselves: exposure, gain, white balance, focus."""

from __future__ import annotations

import errno
import os
import struct
from dataclasses import dataclass

from tactile_core.errors import DeviceError, DeviceForbidden
from tactile_core.interfaces.usb_bus import permission_advice

# Requests VIDIOC_QUERYCTRL, VIDIOC_G_CTRL and VIDIOC_S_CTRL (`linux/videodev2.h`).
_QUERY, _GET, _SET = 0xC0445624, 0xC008561B, 0xC008561C

# `struct v4l2_queryctrl` and `struct v4l2_control`, as struct writes them.
_QUERY_FORM, _VALUE_FORM = "=II32siiiiI8x", "=Ii"


AUTO_WHITE_BALANCE, AUTO_GAIN, GAIN, WHITE_BALANCE = 0x0098090C, 0x00980912, 0x00980913, 0x0098091A
EXPOSURE_MODE, EXPOSURE, RATE_MAY_CHANGE = 0x009A0901, 0x009A0902, 0x009A0903
FOCUS, AUTO_FOCUS, ZOOM = 0x009A090A, 0x009A090C, 0x009A090D
# Control ids (`linux/v4l2-controls.h`); exposure is in units of 100 µs, white balance in K.
BRIGHTNESS, CONTRAST, SATURATION = 0x00980900, 0x00980901, 0x00980902

# Controls by the names that a profile uses.
NAMED = {
    "brightness": BRIGHTNESS,
    "contrast": CONTRAST,
    "exposure": EXPOSURE,
    "focus": FOCUS,
    "gain": GAIN,
    "saturation": SATURATION,
    "white_balance": WHITE_BALANCE,
    "zoom": ZOOM,
}

_MANUAL_EXPOSURE = 1
_EXPOSURE_UNIT_S = 1e-4  # V4L2_EXPOSURE_MANUAL, and the unit of V4L2_CID_EXPOSURE_ABSOLUTE, s


@dataclass(frozen=True)
class ControlRange:
    """Values that a control takes, in the camera's own units."""

    lowest: int
    highest: int
    step: int


class DeviceControls:
    """The controls of a V4L2 device file that is open.

    Parameters
    ----------
    descriptor : int
        Of the open file; any number of programs may use controls at the same time.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def range_of(self, control: int) -> ControlRange | None:
        """Return the values that a control takes; None if the camera lacks it."""
        from fcntl import ioctl  # absent on Windows

        asked = struct.pack(_QUERY_FORM, control, 0, b"", 0, 0, 0, 0, 0)
        try:
            found = struct.unpack(_QUERY_FORM, ioctl(self._descriptor, _QUERY, asked))
        except OSError as error:
            if error.errno in (errno.EINVAL, errno.ENOTTY):
                return None
            raise
        _, _, _, lowest, highest, step, _, flags = found
        # V4L2_CTRL_FLAG_DISABLED
        return None if flags & 0x1 else ControlRange(lowest, highest, max(step, 1))

    def get(self, control: int) -> int:
        """Return the value of a control."""
        from fcntl import ioctl

        asked = struct.pack(_VALUE_FORM, control, 0)
        return int(struct.unpack(_VALUE_FORM, ioctl(self._descriptor, _GET, asked))[1])

    def set(self, control: int, value: int) -> None:
        """Set a control."""
        from fcntl import ioctl

        ioctl(self._descriptor, _SET, struct.pack(_VALUE_FORM, control, value))


@dataclass(frozen=True)
class LockedSettings:
    """Settings of a camera, as it reports them.

    Attributes
    ----------
    exposure_time_s : float or None
    gain : float or None
        In the camera's own units.
    notes : tuple of str
        Settings that the camera still changes by itself.
    """

    exposure_time_s: float | None
    gain: float | None
    notes: tuple[str, ...]


def lock(
    controls: DeviceControls,
    name: str,
    *,
    exposure_time_s: float | None = None,
    gain: float | None = None,
    white_balance_k: float | None = None,
    focus: float | None = None,
) -> LockedSettings:
    """Switch automatic control off for each given setting, set it, and read it back.

    A setting that is not given is left as it is.

    Parameters
    ----------
    controls : DeviceControls
    name : str
        Of the camera, in messages.

    Raises
    ------
    DeviceError
        The camera lacks a setting, or chose another value; the message gives what it takes.
    """
    panel = _Panel(controls, name)
    panel.lock("exposure_time_s", exposure_time_s, EXPOSURE, EXPOSURE_MODE, _EXPOSURE_UNIT_S)
    panel.lock("gain", gain, GAIN, AUTO_GAIN)
    panel.lock("white_balance_k", white_balance_k, WHITE_BALANCE, AUTO_WHITE_BALANCE)
    panel.lock("focus", focus, FOCUS, AUTO_FOCUS)
    if controls.range_of(RATE_MAY_CHANGE) is not None:
        controls.set(RATE_MAY_CHANGE, 0)  # else dark scenes lower the frame rate
    manual = panel.value(EXPOSURE_MODE) in (None, _MANUAL_EXPOSURE)
    exposure = panel.value(EXPOSURE) if manual else None
    got_gain = panel.value(GAIN)
    return LockedSettings(
        None if exposure is None else exposure * _EXPOSURE_UNIT_S,
        None if got_gain is None else float(got_gain),
        tuple(panel.automatic()),
    )


def set_named(controls: DeviceControls, camera: str, name: str, value: int) -> int:
    """Set a control by its name, and return its value as the camera reports it.

    Parameters
    ----------
    controls : DeviceControls
    camera, name : str
        Of the camera, in messages, and of the control, from :data:`NAMED`.
    value : int
        In the camera's own units.

    Raises
    ------
    DeviceError
        There is no such control, or the camera lacks it or refuses the value.
    """
    if name not in NAMED:
        raise DeviceError(f"there is no control {name!r}; the controls are {', '.join(NAMED)}")
    takes = controls.range_of(NAMED[name])
    if takes is None:
        raise DeviceError(f"{camera} has no control {name!r}")
    try:
        controls.set(NAMED[name], value)
    except OSError as error:
        raise DeviceError(
            f"{camera} refuses {name} {value} ({error.strerror}); it takes {takes.lowest} to "
            f"{takes.highest}"
        ) from error
    return controls.get(NAMED[name])


class _Panel:
    """The controls of one camera, with messages that name it."""

    def __init__(self, controls: DeviceControls, name: str) -> None:
        self._controls, self._name = controls, name

    def lock(
        self, option: str, wanted: float | None, control: int, automatic: int, unit: float = 1.0
    ) -> None:
        if wanted is None:
            return
        takes = self._controls.range_of(control)
        if takes is None:
            raise DeviceError(
                f"{self._name} has no control for {option}; remove 'camera.{option}' from the "
                f"profile"
            )
        limits = f"{takes.lowest * unit:g} to {takes.highest * unit:g}"
        try:
            if self._controls.range_of(automatic) is not None:
                self._controls.set(automatic, 1 if automatic == EXPOSURE_MODE else 0)
            self._controls.set(control, round(wanted / unit))
        except OSError as error:
            raise DeviceError(
                f"{self._name} refuses {option}: {wanted:g} ({error.strerror}); it takes {limits}, "
                f"so correct 'camera.{option}'"
            ) from error
        got = self._controls.get(control)
        if abs(got - wanted / unit) > takes.step:
            raise DeviceError(
                f"{self._name} chose {option}: {got * unit:g} instead of {wanted:g}; it takes "
                f"{limits}, so correct 'camera.{option}'"
            )

    def value(self, control: int) -> int | None:
        """Return the value of a control; None if the camera lacks it."""
        return None if self._controls.range_of(control) is None else self._controls.get(control)

    def automatic(self) -> list[str]:
        """Return a sentence for each setting that the camera changes by itself."""
        left = {
            "exposure_time_s": self.value(EXPOSURE_MODE) not in (None, _MANUAL_EXPOSURE),
            "gain": bool(self.value(AUTO_GAIN)),
            "white_balance_k": bool(self.value(AUTO_WHITE_BALANCE)),
            "focus": bool(self.value(AUTO_FOCUS)),
        }
        return [
            f"{self._name} changes its {option.partition('_')[0]} by itself, which changes "
            f"measured values; set 'camera.{option}' in the profile"
            for option, automatic in left.items()
            if automatic
        ]


def opened_for_controls(path: str) -> int:
    """Open a device file for its controls.

    Raises
    ------
    DeviceError
        The file is absent, or the user may not open it.
    """
    try:
        return os.open(path, os.O_RDWR | os.O_NONBLOCK)
    except FileNotFoundError:
        raise DeviceError(
            f"{path} does not exist, although the kernel lists the camera; give a container access "
            f"to it ('docker run --device {path} …')"
        ) from None
    except PermissionError:
        raise DeviceForbidden(
            f"you may not open {path}; {permission_advice()}; without a desktop session add "
            f"yourself to its group ('sudo usermod -aG video $USER', then log in again)"
        ) from None
    except OSError as error:
        raise DeviceError(f"{path} cannot be opened: {error.strerror}; unplug it once") from error
