"""Which device file belongs to which USB camera."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from support.sysfs import Sysfs

from tactile_core.builtin.cameras.video_nodes import select_node, video_nodes
from tactile_core.errors import DeviceError


@pytest.fixture
def sysfs(tmp_path: Path) -> Sysfs:
    return Sysfs(tmp_path / "sys")


def test_a_camera_is_described_by_its_usb_device(sysfs: Sysfs) -> None:
    path, _ = sysfs.plug("1-2.4", serial="C310A001")
    (node,) = video_nodes(sysfs.root)
    assert node.path == path
    assert (node.usb_id, node.product) == ("046d:081b", "HD Webcam C310")
    assert (node.serial, node.port) == ("C310A001", "1-2.4")
    assert str(node) == "046d:081b 'HD Webcam C310' (serial C310A001, port 1-2.4)"


def test_of_each_camera_only_the_node_with_images_counts(sysfs: Sysfs) -> None:
    first, _ = sysfs.plug("1-1", serial="A", nodes=2)
    second, *_ = sysfs.plug("1-2", serial="B", nodes=4)
    assert [node.path for node in video_nodes(sysfs.root)] == [first, second]


def test_a_camera_that_is_unplugged_while_it_is_looked_at_is_left_out(
    sysfs: Sysfs, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone, _ = sysfs.plug("1-1", serial="A")
    kept, _ = sysfs.plug("1-2", serial="B")
    read = os.readlink

    def readlink(path: str) -> str:
        if Path(path).name == Path(gone).name:
            raise FileNotFoundError(path)
        return read(path)

    monkeypatch.setattr(os, "readlink", readlink)
    assert [node.path for node in video_nodes(sysfs.root)] == [kept]


def test_video_devices_that_are_not_on_the_usb_are_no_cameras(sysfs: Sysfs) -> None:
    sysfs.add_other()
    assert video_nodes(sysfs.root) == []


def test_a_system_without_video_has_no_cameras(tmp_path: Path) -> None:
    assert video_nodes(tmp_path) == []


@pytest.mark.parametrize(
    "wanted",
    [
        {"serial": "B"},
        {"port": "1-2"},
        {"usb_id": "0c45:636d"},
        {"product": "gelsight"},
        {"usb_id": "0c45:636d", "serial": "B", "product": "Mini", "port": "1-2"},
    ],
)
def test_each_property_selects_a_camera(sysfs: Sysfs, wanted: dict[str, str]) -> None:
    sysfs.plug("1-1", serial="A")
    path, _ = sysfs.plug("1-2", "0c45:636d", "GelSight Mini R0B", "B")
    assert select_node(video_nodes(sysfs.root), **wanted).path == path


def test_the_only_camera_needs_no_properties(sysfs: Sysfs) -> None:
    path, _ = sysfs.plug()
    assert select_node(video_nodes(sysfs.root)).path == path


def test_another_serial_is_an_error_that_lists_what_is_connected(sysfs: Sysfs) -> None:
    sysfs.plug("1-1", serial="A")
    with pytest.raises(DeviceError, match=r"no connected camera has serial B; connected are .*A, "):
        select_node(video_nodes(sysfs.root), serial="B")


def test_two_of_a_kind_are_an_error_that_lists_them(sysfs: Sysfs) -> None:
    sysfs.plug("1-1", serial="A")
    sysfs.plug("1-2", serial="B")
    message = r"2 cameras match usb_id 046d:081b: .*serial A.*serial B.*; write 'serial' in"
    with pytest.raises(DeviceError, match=message):
        select_node(video_nodes(sysfs.root), usb_id="046d:081b")


def test_two_of_a_kind_without_serials_are_distinguished_by_port(sysfs: Sysfs) -> None:
    for port in ("1-1", "1-2"):
        sysfs.plug(port)
    with pytest.raises(DeviceError, match=r"no serial, port 1-1\).*write 'port' in 'camera'"):
        select_node(video_nodes(sysfs.root))
    assert select_node(video_nodes(sysfs.root), port="1-2").port == "1-2"


def test_without_any_camera_the_error_says_what_was_wanted() -> None:
    with pytest.raises(DeviceError, match=r"no USB camera is connected \(wanted: serial 7\)"):
        select_node([], serial="7")


def test_of_two_streams_of_one_device_the_message_names_what_chooses_one(sysfs: Sysfs) -> None:
    first, second = sysfs.plug("1-2", serial="B", nodes=1, streams=2)
    with pytest.raises(DeviceError, match=r"port 1-2:1\.0.*port 1-2:1\.2.*write 'port' in"):
        select_node(video_nodes(sysfs.root), port="1-2")
    found = [select_node(video_nodes(sysfs.root), port=f"1-2:1.{n}").path for n in (0, 2)]
    assert found == [first, second]
