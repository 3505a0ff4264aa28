"""What an emulated camera is: its name, its controls, its modes and what it sees."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from hardware.plugged import CAMERA, PROCESSING

_GET_AND_SET, _CHANGES = 0x03, 0x08
"""What a control can do, and that the camera itself changes it (UVC 1.0, table 4-3)."""


class Control:
    """One control of a camera, which clamps what it is set to.

    A camera may report less than it took: ``most_reported`` limits what is read back, and the
    host then reads it back each time.
    """

    def __init__(
        self,
        size: int,
        default: int,
        lowest: int,
        highest: int,
        step: int = 1,
        most_reported: int | None = None,
    ) -> None:
        self.size, self.default, self.value = size, default, default
        self.lowest, self.highest, self.step = lowest, highest, step
        self._most_reported = highest if most_reported is None else most_reported
        self.info = _GET_AND_SET if most_reported is None else _GET_AND_SET | _CHANGES

    @property
    def reported(self) -> int:
        """What the camera says that its value is."""
        return min(self.value, self._most_reported)


ControlSet = Mapping[tuple[int, int], Control]
"""Controls by unit and selector."""


def webcam_controls() -> ControlSet:
    """Return exposure, gain and white balance, automatic at first."""
    return {
        (CAMERA, 0x02): Control(1, 8, 0, 15, 9),  # exposure mode: aperture priority
        (CAMERA, 0x04): Control(4, 156, 1, 5000),  # exposure, 100 µs
        (PROCESSING, 0x04): Control(2, 64, 0, 255),  # gain
        (PROCESSING, 0x0A): Control(2, 4000, 2800, 6500, 10),  # white balance, K
        (PROCESSING, 0x0B): Control(1, 1, 0, 1),  # automatic white balance
    }


@dataclass(frozen=True)
class Mode:
    """A size of the images, how many a second the camera offers, and what it then sees.

    ``picture`` returns the JPEG, or the bytes of the YUYV image, that begins at a time.
    """

    width: int
    height: int
    rates: tuple[int, ...]
    picture: Callable[[float], bytes]

    @property
    def bytes(self) -> int:
        """Most bytes of an image."""
        return 2 * self.width * self.height


@dataclass(frozen=True)
class Model:
    """What a kind of camera is."""

    vendor_id: int
    product_id: int
    manufacturer: str
    product: str
    format: Literal["mjpeg", "yuyv"] = "mjpeg"
    controls: Callable[[], ControlSet] = webcam_controls


C310 = Model(0x046D, 0x081B, "Logitech", "HD Webcam C310")
