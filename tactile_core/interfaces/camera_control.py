"""Cameras whose controls other devices use, such as lights that hang on a camera's zoom."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


@runtime_checkable
class ControlledCamera(Protocol):
    """A camera with controls, by name: ``zoom``, ``focus``, ``gain`` and so on."""

    @property
    def is_open(self) -> bool:
        """Whether the camera is open."""

    def set_control(self, name: str, value: int) -> int:
        """Set a control, and return its value as the camera reports it afterwards.

        Raises
        ------
        DeviceError
            The camera is closed or disconnected, or has no such control.
        """
