"""What cameras and lights share: open, close, and a clear word when that fails."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import ClassVar, Self

from pydantic import BaseModel, ConfigDict

from tactile_core.errors import DeviceError


class Options(BaseModel):
    """Base of a component's options: unknown keys are errors, numbers finite, values frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Device(ABC):
    """A thing that is opened before use and closed after it.

    ``open`` and ``close`` are idempotent; a failed ``open`` leaves nothing open. Authors write
    ``_open`` and ``_close``.
    """

    Options: ClassVar[type[BaseModel]] = Options

    def __init__(self, options: BaseModel) -> None:
        self.options = options
        self._is_open = False

    @property
    def is_open(self) -> bool:
        """Whether the device is open."""
        return self._is_open

    def open(self) -> Self:
        """Open the device; does nothing when it is open already.

        Raises
        ------
        DeviceError
            The device is absent, busy or refuses; nothing is left open.
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
        """Close the device; does nothing when it is closed already."""
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
        # a _close that stumbles over what was never acquired must not hide why opening failed
        try:
            self._close()
        except Exception as second:
            error.add_note(f"{type(self).__name__}._close failed as well: {second!r}")

    @abstractmethod
    def _open(self) -> None:
        """Acquire the device."""

    @abstractmethod
    def _close(self) -> None:
        """Release whatever is held, also after a half-finished ``_open``; must not raise."""
