"""A live sensor over real protocols: a camera on a local server, and lights at a terminal."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from support.mjpeg_server import Exchange

PERIOD_S = 0.01
NAMES = ("red", "green", "blue")


def send(exchange: Exchange) -> None:
    """Send an image every ``PERIOD_S``, each a little different, until the server stops."""
    exchange.begin()
    picture = np.full((48, 64, 3), 100, np.uint8)
    while not exchange.stopped.wait(PERIOD_S):
        picture[0, 0, 0] = (int(picture[0, 0, 0]) + 1) % 256
        exchange.send_image(bytes(cv2.imencode(".png", picture)[1]))


def stream(url: str) -> str:
    """Return the camera of a profile."""
    return f'{{use: core.stream, url: "{url}"}}'


def box(port: object, names: tuple[str, ...] = NAMES) -> str:
    """Return the light driver of a profile."""
    return f"{{use: core.serial_leds, lights: [{', '.join(names)}], port: {port}}}"


def profile(folder: Path, camera: str, driver: str | None = None) -> Path:
    """Write a profile with three lights."""
    path = folder / "live.yaml"
    lights = "".join(
        f"    - {{name: {name}, azimuth_deg: {90 + 120 * number}, elevation_deg: 35}}\n"
        for number, name in enumerate(NAMES)
    )
    driven = "" if driver is None else f"  driver: {driver}\n"
    path.write_text(
        "schema: 1\nname: live\nimage: {width_px: 64, height_px: 48, mm_per_px: 0.1}\n"
        f"camera: {camera}\nillumination:\n  use: core.constant\n  lights:\n{lights}{driven}"
    )
    return path
