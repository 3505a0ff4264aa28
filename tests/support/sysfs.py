"""Trees of files laid out as the kernel describes USB cameras in /sys."""

from __future__ import annotations

from pathlib import Path


class Sysfs:
    """A tree in which a test plugs cameras in and out."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._count = 0
        (root / "class" / "video4linux").mkdir(parents=True)

    def plug(
        self,
        port: str = "1-2",
        usb_id: str = "046d:081b",
        product: str = "HD Webcam C310",
        serial: str = "",
        *,
        nodes: int = 2,
        streams: int = 1,
    ) -> list[str]:
        """Connect a camera with several nodes a stream; return the paths of their device files."""
        usb = self.root / "devices" / "pci0000:00" / "0000:00:14.0" / "usb1" / port
        interfaces = [usb / f"{port}:1.{2 * stream}" for stream in range(streams)]
        for interface in interfaces:
            interface.mkdir(parents=True)
        vendor_id, product_id = usb_id.split(":")
        texts = {"idVendor": vendor_id, "idProduct": product_id, "product": product}
        for name, text in (texts | {"serial": serial}).items():
            if text:
                (usb / name).write_text(f"{text}\n")
        return [self._add(one, product, index) for one in interfaces for index in range(nodes)]

    def add_other(self) -> None:
        """Connect a video device that is not on the USB."""
        self._add(self.root / "devices" / "platform" / "vivid.0", "vivid", 0)

    def _add(self, parent: Path, name: str, index: int) -> str:
        node = f"video{self._count}"
        self._count += 1
        folder = parent / "video4linux" / node
        folder.mkdir(parents=True)
        (folder / "index").write_text(f"{index}\n")
        (folder / "name").write_text(f"{name}\n")
        (folder / "device").symlink_to("../..")
        link = self.root / "class" / "video4linux" / node
        link.symlink_to(Path("../..") / folder.relative_to(self.root))
        return f"/dev/{node}"
