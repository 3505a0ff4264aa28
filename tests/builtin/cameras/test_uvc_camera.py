"""Finding a webcam and refusing what cannot be opened; its images are tested in tests/hardware."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import ValidationError
from support.sysfs import Sysfs

from tactile_core.builtin.cameras import uvc_camera
from tactile_core.builtin.cameras.uvc_camera import UvcCamera, UvcOptions
from tactile_core.errors import DeviceError, InputError
from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.testing.imports import Footprint


@pytest.fixture
def sysfs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Sysfs:
    built = Sysfs(tmp_path / "sys")
    monkeypatch.setattr(UvcCamera, "sysfs", built.root)
    monkeypatch.setattr(sys, "platform", "linux")
    return built


def opening(**options: object) -> UvcCamera:
    return UvcCamera(UvcOptions.model_validate(options))


def test_a_camera_that_is_not_connected_is_an_error(sysfs: Sysfs) -> None:
    with pytest.raises(DeviceError, match=r"no USB camera is connected \(wanted: serial 42\)"):
        opening(serial="42").open()


def test_two_of_a_kind_are_listed(sysfs: Sysfs) -> None:
    sysfs.plug("1-1", serial="A")
    sysfs.plug("1-2", serial="B")
    with pytest.raises(DeviceError, match=r"serial A, .*serial B, "):
        opening(usb_id="046d:081b").open()


def test_an_index_is_refused_where_a_camera_can_be_found_by_what_it_is(sysfs: Sysfs) -> None:
    with pytest.raises(InputError, match=r"an index is another camera after each restart"):
        opening(index=0).open()


@pytest.mark.parametrize("options", [{}, {"index": 0, "serial": "A", "gain": 3}])
def test_elsewhere_than_on_linux_only_the_index_is_possible(
    options: dict[str, object], sysfs: Sysfs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(InputError, match=r"write 'index: 0' in 'camera', without (other|gain, se)"):
        opening(**options).open()


def test_a_device_file_that_is_missing_leaves_nothing_open(sysfs: Sysfs) -> None:
    sysfs._count = 4_000_000  # no machine has so many cameras
    sysfs.plug(serial="A")
    before = Footprint.take_snapshot()
    camera = opening(serial="A")
    with pytest.raises(DeviceError, match="/dev/video4000000 does not exist"):
        camera.open()
    assert camera.device_id == "A"
    assert before.find_leaks() == ""


def test_a_usb_id_has_the_form_of_the_list_of_devices() -> None:
    with pytest.raises(ValidationError):
        UvcOptions(usb_id="46d:81b")


def test_connected_webcams_are_listed_although_libusb_is_missing(
    sysfs: Sysfs, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_libusb(_: object) -> Iterator[ConnectedDevice]:
        raise DeviceError("no libusb")

    (path, _) = sysfs.plug("1-2.4", serial="A")
    monkeypatch.setattr(uvc_camera, "usb_cameras", no_libusb)
    listed = UvcCamera.connected()
    assert next(listed) == ConnectedDevice(path, "HD Webcam C310", "046d:081b", "A", "1-2.4")
    with pytest.raises(DeviceError, match="no libusb"):
        next(listed)


def test_a_webcam_without_a_device_file_is_listed_once(
    sysfs: Sysfs, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path, _) = sysfs.plug("1-1")
    on_usb = [ConnectedDevice("", "C310", "046d:081b", None, port) for port in ("1-1", "1-2")]
    monkeypatch.setattr(uvc_camera, "usb_cameras", lambda _: iter(on_usb))
    assert [(one.place, one.port_path) for one in UvcCamera.connected()] == [
        (path, "1-1"),
        ("", "1-2"),
    ]
