"""``core.uvc``: a webcam, found by what it is and not by an index."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import BaseModel, Field, NonNegativeFloat, NonNegativeInt, PositiveFloat, PositiveInt

from tactile_core.builtin.cameras.video_capture import VideoCapture, Wanted
from tactile_core.builtin.cameras.video_controls import (
    DeviceControls,
    LockedSettings,
    lock,
    opened_for_controls,
    set_named,
)
from tactile_core.builtin.cameras.video_nodes import SYSFS, VideoNode, select_node, video_nodes
from tactile_core.errors import DeviceBusy, DeviceError, InputError
from tactile_core.interfaces.device import ConnectedDevice, Options
from tactile_core.interfaces.streaming.streaming_camera import ImageSource, StreamingCamera
from tactile_core.interfaces.usb_bus import VIDEO, holders, name_holders, usb_cameras


class UvcOptions(Options):
    """Options of ``core.uvc``."""

    usb_id: str | None = Field(
        default=None,
        pattern=r"^[0-9a-f]{4}:[0-9a-f]{4}$",
        description="Vendor and product id in the format of 'tactile devices': '046d:081b'.",
    )
    product: str | None = Field(default=None, description="Part of the product's name.")
    serial: str | None = Field(default=None, description="Serial number of the camera.")
    port: str | None = Field(
        default=None,
        description="USB port, such as '1-2.4', for cameras of one kind without serial numbers.",
    )
    index: NonNegativeInt | None = Field(
        default=None, description="Index of the camera; only where Linux does not list cameras."
    )
    width_px: PositiveInt | None = Field(default=None, description="Default: the camera's choice.")
    height_px: PositiveInt | None = Field(default=None, description="Default: the camera's choice.")
    fps: PositiveFloat | None = Field(default=None, description="Images a second.")
    format: Literal["MJPG", "YUYV"] = Field(
        default="MJPG", description="MJPG is compressed by the camera; YUYV needs more bandwidth."
    )
    buffers: PositiveInt = Field(
        default=10,
        le=10,
        description="Images that the driver holds while the computer is busy. They make no image "
        "older, because the reader thread takes them at once.",
    )
    exposure_time_s: PositiveFloat | None = Field(
        default=None, description="Default: the camera's, which may change by itself."
    )
    gain: NonNegativeFloat | None = Field(
        default=None, description="In the camera's own units; see exposure_time_s."
    )
    white_balance_k: PositiveFloat | None = Field(
        default=None, description="Colour temperature, K; see exposure_time_s."
    )
    focus: NonNegativeFloat | None = Field(
        default=None, description="In the camera's own units; see exposure_time_s."
    )


class UvcCamera(StreamingCamera):
    """A USB video class camera, on Linux through V4L2.

    The camera is found by USB id, product, serial or port. Exposure, gain, white balance and focus
    that the profile gives are locked and read back. Timestamps are those of the driver, less half
    of the exposure if it is locked.

    Attributes
    ----------
    sysfs : Path
        Where the kernel describes devices.
    """

    Options: ClassVar[type[BaseModel]] = UvcOptions
    selectors: ClassVar[Mapping[str, str]] = {
        "usb_id": "usb_id",
        "product": "product",
        "serial": "serial",
        "port": "port_path",
    }
    sysfs: ClassVar[Path] = SYSFS

    def __init__(self, options: UvcOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._node: VideoNode | None = None
        self._notes: tuple[str, ...] = ()
        self._rate_hz: float | None = None

    @classmethod
    def connected(cls) -> Iterator[ConnectedDevice]:
        """Yield the webcams that Linux lists, then those that only libusb finds."""
        ports = set()
        for node in video_nodes(cls.sysfs):
            ports.add(node.port)
            yield ConnectedDevice(
                node.path,
                node.product,
                node.usb_id,
                node.serial or None,
                node.port,
                tuple(holders(node.path)),
            )
        for other in usb_cameras(VIDEO):
            if other.port_path not in ports:
                yield other

    @property
    def device_id(self) -> str:
        """The serial number, else the USB port; empty before the camera is found."""
        if self._node is None:
            return ""
        return self._node.serial or f"usb-{self._node.port}"

    @property
    def notes(self) -> tuple[str, ...]:
        """What the camera chose, and what it changes by itself."""
        return self._notes

    @property
    def nominal_rate_hz(self) -> float | None:
        """Images a second that the camera has chosen."""
        return self._rate_hz

    def set_control(self, name: str, value: int) -> int:
        """Set a control, such as ``zoom``, and return its value as the camera reports it.

        Raises
        ------
        DeviceError
            The camera is closed or disconnected, or has no such control.
        """
        self._require_open()
        if self._node is None:
            raise DeviceError("on this system the controls of a camera cannot be set")
        descriptor = opened_for_controls(self._node.path)
        try:
            return set_named(DeviceControls(descriptor), self._name, name, value)
        except OSError as error:
            raise DeviceError(f"{self._name} fails: {error.strerror}; unplug it once") from error
        finally:
            os.close(descriptor)

    @property
    def _name(self) -> str:
        return "the camera" if self._node is None else f"the camera {self._node}"

    def _connect(self) -> ImageSource:
        self._node, self._notes = None, ()
        if sys.platform != "linux":
            return self._connect_by_index()
        options = self._settings
        if options.index is not None:
            raise InputError(
                "an index is another camera after each restart; on Linux write 'serial', 'usb_id', "
                "'product' or 'port' in 'camera' instead ('tactile devices' lists them)"
            )
        node = select_node(
            video_nodes(self.sysfs),
            usb_id=options.usb_id,
            product=options.product,
            serial=options.serial,
            port=options.port,
        )
        self._node = node
        # another object of this process may have it; opening would disturb that one
        self._refuse_a_second()
        descriptor = opened_for_controls(node.path)
        try:
            return self._connect_to(node, DeviceControls(descriptor))
        finally:
            os.close(descriptor)

    def _connect_to(self, node: VideoNode, controls: DeviceControls) -> VideoCapture:
        try:
            capture = VideoCapture(node.path, self._name, self._make_wanted(), node.entry.exists)
        except DeviceError as error:
            others = name_holders(node.path)
            if others:
                raise DeviceBusy(f"{self._name} is in use{others}; close that first") from error
            raise
        try:
            capture.await_first()  # before locking, because some cameras reset when they start
            options = self._settings
            locked = lock(
                controls,
                self._name,
                exposure_time_s=options.exposure_time_s,
                gain=options.gain,
                white_balance_k=options.white_balance_k,
                focus=options.focus,
            )
            self._apply(locked, capture)
        except OSError as error:
            capture.close()
            raise DeviceError(f"{self._name} fails: {error.strerror}; unplug it once") from error
        except BaseException:
            capture.close()
            raise
        return capture

    def _apply(self, locked: LockedSettings, capture: VideoCapture) -> None:
        capture.exposure_time_s, capture.gain = locked.exposure_time_s, locked.gain
        self._rate_hz = capture.rate_hz or self._settings.fps
        period_s = 1 / (self._rate_hz or 30.0)  # 30 Hz: most webcams
        # [images] A camera may still expose these with the settings before
        capture.valid_from_s = time.monotonic() + 3 * period_s
        self._notes = (f"{self._name} sends {capture.described}", *locked.notes)

    def _connect_by_index(self) -> ImageSource:
        options = self._settings
        given = {"exposure_time_s", "gain", "white_balance_k", "focus", "serial", "port"}
        unsupported = sorted(key for key in given if getattr(options, key) is not None)
        if options.index is None or unsupported:
            raise InputError(
                "on this system a camera is opened by its index alone; write 'index: 0' in "
                f"'camera', without {', '.join(unsupported) or 'other ways to find it'}"
            )
        capture = VideoCapture(options.index, f"the camera {options.index}", self._make_wanted())
        self._notes = (
            f"the camera was opened by its index {options.index}, so it may be another one than "
            f"the profile's, and its exposure, gain and white balance are not locked",
        )
        return capture

    def _make_wanted(self) -> Wanted:
        options = self._settings
        return Wanted(
            options.width_px, options.height_px, options.fps, options.format, options.buffers
        )
