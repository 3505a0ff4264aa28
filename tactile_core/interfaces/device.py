"""What cameras and light drivers share: options, opening and closing, and what is connected."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict

from tactile_core.errors import DeviceError


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


class Options(BaseModel):
    """Base of a component's options: frozen, no unknown keys, finite numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Closing:
    """Closes itself at the end of a ``with`` block; an error in there stays the reason."""

    def close(self) -> None:
        """Release what it holds."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except Exception as second:
            if error is None:
                raise
            error.add_note(f"closing failed as well: {second}")


class Device(Closing, ABC):
    """A device that is opened before use and closed afterwards.

    ``open`` and ``close`` are idempotent; a failed ``open`` leaves nothing open. Implement
    ``_open`` and ``_close``; also ``connected`` and ``selectors`` if there can be several.

    Attributes
    ----------
    selectors : mapping of str to str
        The options by which one of several devices is chosen, each with the attribute of
        :class:`~tactile_core.interfaces.device.ConnectedDevice` that it must equal.
    """

    Options: ClassVar[type[BaseModel]] = Options
    selectors: ClassVar[Mapping[str, str]] = {}

    def __init__(self, options: BaseModel) -> None:
        self.options = options
        self._is_open = False

    @classmethod
    def connected(cls) -> Iterator[ConnectedDevice]:
        """Yield the connected devices that this class could open, without opening them.

        ``tactile devices`` lists them.

        Raises
        ------
        DeviceError
            Not all can be listed, because a library or a permission is missing; raised after those
            that can.
        """
        return iter(())

    @property
    def is_open(self) -> bool:
        """Whether the device is open."""
        return self._is_open

    def open(self) -> Self:
        """Open the device; do nothing if it is already open.

        Raises
        ------
        DeviceError
            The device is absent, busy or cannot be opened; nothing is left open.
        """
        if not self._is_open:
            try:
                self._open()
            except BaseException as error:
                self._release_after(error)
                raise
            self._is_open = True
        return self

    def close(self) -> None:
        """Close the device; do nothing if it is already closed."""
        if self._is_open:
            self._is_open = False
            self._close()

    def __enter__(self) -> Self:
        return self.open()

    def _require_open(self) -> None:
        if not self._is_open:
            raise DeviceError(
                f"{type(self).__name__} is closed; open() it first or use it in a 'with' block"
            )

    def _release_after(self, error: BaseException) -> None:
        # _close may fail on what was never acquired; that must not hide why opening failed
        try:
            self._close()
        except Exception as second:
            error.add_note(f"{type(self).__name__}._close failed as well: {second!r}")

    @abstractmethod
    def _open(self) -> None:
        """Acquire the device."""

    @abstractmethod
    def _close(self) -> None:
        """Release all resources, also after a partial ``_open``; must not raise."""
