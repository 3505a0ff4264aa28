"""A device that is plugged in, as the component that could open it sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ConnectedDevice:
    """What is known of a device without opening it.

    Attributes
    ----------
    place : str
        Device file or address, which may change with each connection; "" if the system offers none.
    product : str
        Its name; "" if it has none, or if the user lacks permission to read it.
    usb_id : str or None
        Vendor and product id in the format of ``lsusb``; None for a device that is not on USB.
    serial : str or None
        Serial number; None if it has none, or if the user lacks permission to read it.
    port_path : str or None
        USB bus and ports, such as ``"1-2.4"``; the same as long as it stays plugged in there.
    held_by : tuple of str
        The programs that have it open, as far as the user may know them.
    """

    place: str
    product: str = ""
    usb_id: str | None = None
    serial: str | None = None
    port_path: str | None = None
    held_by: tuple[str, ...] = ()

    def __str__(self) -> str:
        serial = f"serial {self.serial}" if self.serial else "no serial"
        port = f", port {self.port_path}" if self.port_path else ""
        return f"{self.product or self.usb_id or self.place} ({serial}{port})"

    def fits(self, options: Mapping[str, Any], selectors: Mapping[str, str]) -> bool:
        """Return whether a component with these options would open this device.

        Parameters
        ----------
        options : mapping of option to value
            An option that is absent or None takes any device.
        selectors : mapping of option to attribute of this class
            A product's name fits if it contains the value, in any case; the others must be equal.
        """
        for option, attribute in selectors.items():
            wanted, found = options.get(option), getattr(self, attribute) or ""
            if wanted is None:
                continue
            if attribute == "product":
                if str(wanted).casefold() not in found.casefold():
                    return False
            elif wanted != found:
                return False
        return True
