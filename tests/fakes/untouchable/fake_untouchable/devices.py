"""Devices that say when they are made, and refuse to open."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel

from tactile_core.errors import DeviceError
from tactile_core.interfaces import camera, light_driver
from tactile_core.quantities import Image


def touched(what: str) -> None:
    """Note it in the file that the environment names, which other processes share."""
    with Path(os.environ["TOUCHED"]).open("a") as file:
        file.write(what + "\n")


class Camera(camera.Camera):
    def __init__(self, options: BaseModel) -> None:
        super().__init__(options)
        touched("camera made")

    def _open(self) -> None:
        touched("camera opened")

    def _close(self) -> None:
        touched("camera closed")

    def _read(self, timeout_s: float) -> Image | None:
        touched("camera read")
        raise DeviceError("there is no picture")


class Box(light_driver.LightDriver):
    def __init__(self, options: BaseModel) -> None:
        super().__init__(options)
        touched("box made")

    def attach(self, camera: camera.Camera) -> None:
        touched("box attached")

    def _open(self) -> None:
        touched("box opened")

    def _close(self) -> None:
        touched("box closed")

    def _set(self, levels: Mapping[str, float]) -> None:
        touched(f"box set to {dict(levels)}")
