"""USB cameras as Linux lists them: which device file belongs to which camera."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from tactile_core.errors import DeviceAbsent
from tactile_core.interfaces.usb_bus import CLAIM, INSTEAD

SYSFS = Path("/sys")  # Where the kernel describes devices


@dataclass(frozen=True)
class VideoNode:
    """The device file from which a USB camera's images are read.

    Attributes
    ----------
    path : str
        For example ``/dev/video2``; another one after each connection.
    entry : Path
        Its folder in sysfs, which exists as long as the camera is connected.
    usb_id : str
        Vendor and product id in the format of ``lsusb``.
    product, serial : str
        Empty if the camera has none.
    port : str
        Bus and ports, such as ``1-2.4``.
    interface : str
        Its part of the device, such as ``1-2.4:1.0``; a device may have several streams.
    """

    path: str
    entry: Path
    usb_id: str
    product: str
    serial: str
    port: str
    interface: str = ""

    def __str__(self) -> str:
        serial = f"serial {self.serial}" if self.serial else "no serial"
        return f"{self.usb_id} {self.product!r} ({serial}, port {self.port})"


def video_nodes(sysfs: Path = SYSFS) -> list[VideoNode]:
    """Return the node of each connected USB camera that delivers images, sorted by port.

    A camera also has nodes for other data; only the first, of index 0, delivers images.

    Parameters
    ----------
    sysfs : Path
        Root of the kernel's description.
    """
    return sorted(_find_nodes(sysfs), key=lambda node: (node.port, node.path))


def _find_nodes(sysfs: Path) -> Iterator[VideoNode]:
    folder = sysfs / "class" / "video4linux"
    for entry in folder.iterdir() if folder.is_dir() else ():
        try:
            # the link must be resolved first: its target's parent is the USB device
            interface = (entry / "device").resolve()
        except OSError:  # the camera is unplugged at this moment
            continue
        usb = interface.parent
        if _text(entry / "index") != "0" or not _text(usb / "idVendor"):
            continue
        yield VideoNode(
            f"/dev/{entry.name}",
            entry,
            f"{_text(usb / 'idVendor')}:{_text(usb / 'idProduct')}".lower(),
            _text(usb / "product"),
            _text(usb / "serial"),
            usb.name,
            interface.name,
        )


def _text(path: Path) -> str:
    try:
        return path.read_text("utf-8", "replace").strip()
    except OSError:  # absent, or the camera is unplugged at this moment
        return ""


def select_node(
    nodes: Iterable[VideoNode],
    *,
    usb_id: str | None = None,
    product: str | None = None,
    serial: str | None = None,
    port: str | None = None,
) -> VideoNode:
    """Return the one camera that has all given properties.

    Parameters
    ----------
    nodes : iterable of VideoNode
        The connected cameras.
    product : str, optional
        Part of the product's name, in any case; the others must be equal.
    port : str, optional
        Of the camera, or the interface of one of its streams.

    Raises
    ------
    DeviceAbsent
        No camera matches, or several do; the message lists what is connected.
    """
    nodes = list(nodes)
    wanted = {"usb_id": usb_id, "product": product, "serial": serial, "port": port}
    asked = ", ".join(f"{key} {value}" for key, value in wanted.items() if value is not None)
    if not nodes:
        raise DeviceAbsent(
            f"no USB camera is connected{f' (wanted: {asked})' if asked else ''}; connect it (does "
            f"'lsusb' list it?), {INSTEAD}"
        )
    matching = [
        node
        for node in nodes
        if usb_id in (None, node.usb_id)
        and (product or "").casefold() in node.product.casefold()
        and serial in (None, node.serial)
        and port in (None, node.port, node.interface)
    ]
    if not matching:
        raise DeviceAbsent(
            f"no connected camera has {asked}; connected are {_list_nodes(nodes)}; connect that "
            f"camera or correct 'camera' in the profile, {CLAIM}, {INSTEAD}"
        )
    if len(matching) > 1:
        key = "serial" if len({node.serial for node in matching}) == len(matching) else "port"
        if key == "port" and len({node.port for node in matching}) < len(matching):
            matching = [replace(node, port=node.interface) for node in matching]
        raise DeviceAbsent(
            f"{len(matching)} cameras match{f' {asked}' if asked else ''}: {_list_nodes(matching)}"
            f"; write '{key}' in 'camera' of the profile to choose one, or {CLAIM}"
        )
    return matching[0]


def _list_nodes(nodes: Iterable[VideoNode]) -> str:
    return ", ".join(map(str, nodes))
