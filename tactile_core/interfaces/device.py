"""Base class of cameras and light drivers: open and close, with clear errors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import ClassVar, Self

from pydantic import BaseModel, ConfigDict

from tactile_core.errors import DeviceError
from tactile_core.interfaces.connected_device import ConnectedDevice


class Options(BaseModel):
    """Base of a component's options: frozen, no unknown keys, finite numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Device(ABC):
    """A device that is opened before use and closed afterwards.

    ``open`` and ``close`` are idempotent; a failed ``open`` leaves nothing open. Implement
    ``_open`` and ``_close``; also ``connected`` and ``selectors`` if there can be several.

    Attributes
    ----------
    selectors : mapping of str to str
        The options by which one of several devices is chosen, each with the attribute of
        :class:`~tactile_core.interfaces.connected_device.ConnectedDevice` that it must equal.
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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

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
