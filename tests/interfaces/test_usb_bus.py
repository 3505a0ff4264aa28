"""USB cameras by their descriptors."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import usb.core
import usb.util
from usb.backend import IBackend

from tactile_core.errors import DeviceError
from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.interfaces.usb_bus import USB3_VISION, VIDEO, usb_cameras

LANGUAGES = bytes([4, 3, 0x09, 0x04])
CAMERA = {
    "ids": (0x2833, 0x0209),
    "interfaces": ((0x0E, 1), (0x0E, 2), (0x01, 1)),
    "ports": (2, 4),
    "strings": {2: "DIGIT", 3: "D20025"},
}
MACHINE_VISION = {"ids": (0x1E10, 0x4000), "interfaces": ((0xEF, 5),), "ports": (1,)}
MOUSE = {"ids": (0x046D, 0xC077), "interfaces": ((3, 1),), "ports": (3,)}
HUB = {"ids": (0x1D6B, 2), "interfaces": ((9, 0),), "ports": ()}
PROTECTED = {**CAMERA, "ports": (9,), "refuses": True}


class Bus(IBackend):
    """A fake backend with these devices plugged in."""

    def __init__(self, *devices: dict[str, Any]) -> None:
        self.devices = devices
        self.opened = 0

    def enumerate_devices(self) -> Any:
        return iter(self.devices)

    def get_device_descriptor(self, dev: dict[str, Any]) -> Any:
        return SimpleNamespace(
            bLength=18, bDescriptorType=1, bcdUSB=0x200, bDeviceClass=0, bDeviceSubClass=0,
            bDeviceProtocol=0, bMaxPacketSize0=64, idVendor=dev["ids"][0], idProduct=dev["ids"][1],
            bcdDevice=1, iManufacturer=0, iProduct=2, iSerialNumber=3, bNumConfigurations=1,
            address=5, bus=1, port_number=(dev["ports"] or (0,))[-1], port_numbers=dev["ports"],
            speed=3,
        )  # fmt: skip

    def get_configuration_descriptor(self, dev: dict[str, Any], config: int) -> Any:
        if config:
            raise IndexError
        return SimpleNamespace(
            bLength=9, bDescriptorType=2, wTotalLength=9, bNumInterfaces=len(dev["interfaces"]),
            bConfigurationValue=1, iConfiguration=0, bmAttributes=0x80, bMaxPower=250,
            extra_descriptors=(),
        )  # fmt: skip

    def get_interface_descriptor(self, dev: dict[str, Any], intf: int, alt: int, cfg: int) -> Any:
        if alt or intf >= len(dev["interfaces"]):
            raise IndexError
        kind, subclass = dev["interfaces"][intf]
        return SimpleNamespace(
            bLength=9, bDescriptorType=4, bInterfaceNumber=intf, bAlternateSetting=0,
            bNumEndpoints=0, bInterfaceClass=kind, bInterfaceSubClass=subclass,
            bInterfaceProtocol=0, iInterface=0, extra_descriptors=(),
        )  # fmt: skip

    def open_device(self, dev: dict[str, Any]) -> Any:
        if dev.get("refuses"):
            raise usb.core.USBError("Access denied (insufficient permissions)", None, 13)
        self.opened += 1
        return dev

    def close_device(self, dev_handle: Any) -> None:
        self.opened -= 1

    def ctrl_transfer(  # type: ignore[no-untyped-def]
        self, dev_handle, bmRequestType, bRequest, wValue, wIndex, data, timeout
    ) -> int:
        text = dev_handle.get("strings", {}).get(wValue & 0xFF, "").encode("utf-16-le")
        answer = LANGUAGES if not wValue & 0xFF else bytes([2 + len(text), 3]) + text
        data[: len(answer)] = type(data)("B", answer)
        return len(answer)


def test_webcams_and_machine_vision_cameras_are_told_by_their_interface() -> None:
    bus = Bus(MOUSE, CAMERA, HUB, MACHINE_VISION)
    (webcam,) = usb_cameras(VIDEO, bus)
    assert webcam == ConnectedDevice("", "DIGIT", "2833:0209", "D20025", "1-2.4")
    (camera,) = usb_cameras(USB3_VISION, bus)
    assert (camera.usb_id, camera.port_path) == ("1e10:4000", "1-1")
    assert bus.opened == 0


def test_a_device_without_access_is_listed_without_its_strings() -> None:
    (device,) = usb_cameras(VIDEO, Bus(PROTECTED))
    assert (device.usb_id, device.product, device.serial) == ("2833:0209", "", None)


def test_without_cameras_the_list_is_empty() -> None:
    assert list(usb_cameras(VIDEO, Bus(MOUSE))) == []


def test_missing_libusb_is_reported_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_backend(**_: Any) -> Any:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", no_backend)
    with pytest.raises(DeviceError, match="pip install libusb-package"):
        usb_cameras(VIDEO)


def test_a_libusb_error_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(**_: Any) -> Any:
        raise usb.core.USBError("Other error")

    monkeypatch.setattr(usb.core, "find", fails)
    with pytest.raises(DeviceError, match="cannot be listed: Other error"):
        usb_cameras(VIDEO)
