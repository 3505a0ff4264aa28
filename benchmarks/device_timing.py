"""Rates and latency on emulated devices: ``PYTHONPATH=tests python benchmarks/device_timing.py``.

The devices are Aravis's emulated GigE Vision camera, a light box at a pseudo-terminal, and an MJPEG
server, all in this process. Exposure and readout together take a frame period at 30 Hz; images
are sent while they are read out. Needs Aravis and pyserial, and an idle computer.

*Rates* are observations of six lights one after another: acquired, and measured by the whole chain.
*Latency* is from the middle of an exposure to the reading: a light in a corner of the picture
blinks, and the reading that is the first to be bright there is of the first image whose exposure
had its middle after the light went on. The emulated camera knows when that was.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from support.gige_camera import ADDRESS, PaintedCamera, alone
from support.light_box import LIGHTS
from support.lit_gel import EmulatedShutter, LitBox, LitGel
from support.mjpeg_server import Exchange, MjpegServer

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.acquisition.devices import make_devices
from tactile_core.calibration.virtual_unit import VirtualUnit, virtual_unit
from tactile_core.errors import CameraTimeout
from tactile_core.interfaces.illumination import Exposure
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.loader import load_profile
from tactile_genicam.camera import GenicamCamera, GenicamOptions

PERIOD_S = 1 / 30
EXPOSURE_S = 0.005
READOUT_S = PERIOD_S - EXPOSURE_S
PATIENCE_S = 1.0
CORNER = np.s_[:24, :24]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--observations", type=int, default=20, help="of each rate")
    parser.add_argument("--only", choices=("rates", "latency"))
    parser.add_argument("--blinks", type=int, default=40, help="of each camera")
    parser.add_argument("--width", type=int, default=640, help="of the images for latency, px")
    given = parser.parse_args()
    with alone():
        if given.only != "latency":
            print_rates(given.observations)
        if given.only != "rates":
            print_latency(given.blinks, (given.width, given.width * 3 // 4))


def print_rates(count: int) -> None:
    """Print how many observations of six lights a second brings."""
    name = "desktop_six_led"
    unit = virtual_unit(load_profile(name), size_px=(612, 512))
    image = {"image": unit.profile.image.model_dump()}
    gel, box = LitGel(name, image), LitBox()
    height, width, _ = gel.lit.shape
    sending_s = transfer_s(gel.lit[..., 0])
    print(f"an image is sent in {1e3 * sending_s:.1f} ms, while it is read out")
    print("six lights at 30 Hz          acquired/s  (slowest tenth)  measured/s")
    for label, trigger, dark in (
        ("free-running", "none", False),
        ("software trigger", "software", False),
        ("software trigger and dark", "software", True),
    ):
        driver = {"use": "core.serial_leds", "port": box.port, "lights": LIGHTS}
        camera = {"use": "genicam.camera", "address": ADDRESS, "region": [0, 0, width, height]}
        camera |= {"exposure_time_s": EXPOSURE_S, "trigger": trigger}
        camera |= {"fps": 1 / PERIOD_S} if trigger == "none" else {}
        lights = {"illumination": {"dark": dark, "driver": driver}}
        profile = load_profile(name, overrides=image | {"camera": camera} | lights)
        shutter = EmulatedShutter(
            gel, box.history.mean, 1e6 * EXPOSURE_S,
            readout_s=READOUT_S - sending_s, triggered=trigger == "software",
        )  # fmt: skip
        with PaintedCamera("RATES", shutter, width * height):
            opened, illumination, leds = make_devices(profile)
            assert leds is not None
            with leds, opened:
                acquisition = Acquisition(opened, illumination, profile.image, leds)
                acquired_s = times_s(partial(acquisition.observe, PATIENCE_S), count)
            with open_sensor(profile, bundle=unit.bundle, timeout_s=PATIENCE_S) as sensor:
                measured_s = times_s(sensor.read, count)
        slow_s = np.quantile(acquired_s, 0.9)
        print(
            f"{label:28} {1 / np.median(acquired_s):10.2f} {1 / slow_s:16.2f} "
            f"{1 / np.median(measured_s):11.2f}"
        )
    box.unplug()


def transfer_s(image: NDArray[np.uint8]) -> float:
    """Return how long the emulated camera takes to send an image, and this computer to get it."""
    height, width = image.shape
    options = {"address": ADDRESS, "region": (0, 0, width, height), "trigger": "software"}
    camera = GenicamCamera(GenicamOptions.model_validate(options | {"exposure_time_s": 0.00001}))
    with PaintedCamera("RATES", lambda _: image, image.size), camera:
        camera.arm([Exposure({}, ("grey",))])
        return float(np.median(times_s(partial(camera.read, PATIENCE_S), 30)))


def times_s(action: Callable[[], object], count: int) -> NDArray[np.float64]:
    """Return how long each of several calls takes, after a first one.

    A call that fails, as when a busy computer loses a packet, is not counted.
    """
    times: list[float] = []
    action()
    while len(times) < count:
        began_s = time.monotonic()
        with suppress(CameraTimeout):
            action()
            times.append(time.monotonic() - began_s)
    return np.array(times)


class BlinkingLight:
    """A light in the corner of a picture, and the exposures of the camera that sees it."""

    def __init__(self, picture: NDArray[np.uint8], blinks: int) -> None:
        self._picture = picture
        self._gaps_s = np.random.default_rng(1).uniform(9 * PERIOD_S, 15 * PERIOD_S, 2 * blinks + 9)
        self._edges_s = np.full(1, np.inf)
        self.middles_s: list[float] = []

    def begin(self) -> None:
        """Begin to blink."""
        self._edges_s = time.monotonic() + np.cumsum(self._gaps_s)

    @property
    def on_s(self) -> NDArray[np.float64]:
        """Times at which it goes on."""
        return np.asarray(self._edges_s[::2])

    @property
    def ends_s(self) -> float:
        """When it goes off for the last time."""
        return float(self._edges_s[-1])

    def expose(self) -> NDArray[np.uint8]:
        """Return the image whose readout ends now."""
        ended_s = time.monotonic() - READOUT_S
        lit = np.linspace(ended_s - EXPOSURE_S, ended_s, 100)
        share = float(np.mean(np.searchsorted(self._edges_s, lit) % 2))
        self.middles_s.append(ended_s - EXPOSURE_S / 2)
        image = self._picture.copy()
        image[CORNER] = round(255 * share)
        return image


@contextmanager
def gige(light: BlinkingLight) -> Iterator[Mapping[str, Any]]:
    """A GigE Vision camera that sees a light."""
    height, width, _ = light.expose().shape
    with PaintedCamera("BLINK", lambda _: light.expose(), 3 * width * height):
        yield {
            "use": "genicam.camera", "address": ADDRESS, "region": [0, 0, width, height],
            "pixel_format": "RGB8", "fps": 1 / PERIOD_S, "exposure_time_s": EXPOSURE_S,
        }  # fmt: skip


@contextmanager
def mjpeg(light: BlinkingLight) -> Iterator[Mapping[str, Any]]:
    """A camera on the network that sees a light."""

    def send(exchange: Exchange) -> None:
        exchange.begin()
        due_s = time.monotonic()
        while not exchange.stopped.is_set():
            due_s += PERIOD_S
            time.sleep(max(0.0, due_s - time.monotonic()))
            image = cv2.cvtColor(light.expose(), cv2.COLOR_RGB2BGR)
            exchange.send_image(cv2.imencode(".jpg", image)[1].tobytes())

    with MjpegServer(send) as server:
        yield {"use": "core.stream", "url": server.url}


class Latency(NamedTuple):
    """Of the readings, s."""

    whole_s: NDArray[np.float64]
    processing_s: NDArray[np.float64]
    stamps_s: NDArray[np.float64]


def print_latency(blinks: int, size_px: tuple[int, int]) -> None:
    """Print the time from the middle of an exposure to its reading."""
    unit = virtual_unit(load_profile("hex_fingertip"), size_px=size_px)
    print(
        "\nms                  exposure  period  processing  latency  (90 %)   limit  stamp error"
    )
    for label, camera in (("genicam.camera", gige), ("core.stream, MJPEG", mjpeg)):
        light = BlinkingLight(np.ascontiguousarray(unit.frames[0].pixels), blinks)
        with camera(light) as devices:
            found = latency(unit, light, devices, blinks)
        median_s, processing_s = np.median(found.whole_s), np.median(found.processing_s)
        row = (
            *(EXPOSURE_S, PERIOD_S, processing_s, median_s, np.quantile(found.whole_s, 0.9)),
            *(EXPOSURE_S + 1.5 * PERIOD_S + processing_s, np.median(found.stamps_s)),
        )
        print(
            f"{label:20}"
            + "".join(
                f"{1e3 * value:{width}.1f}"
                for value, width in zip(row, (8, 8, 12, 9, 8, 8, 13), strict=True)
            )
        )


def latency(
    unit: VirtualUnit, light: BlinkingLight, camera: Mapping[str, Any], blinks: int
) -> Latency:
    """Measure it, once for each blink."""
    image = unit.profile.image.model_dump()
    profile = load_profile("hex_fingertip", overrides={"image": image, "camera": camera})
    whole, processing, stamps, before = [], [], [], True
    with open_sensor(profile, bundle=unit.bundle, timeout_s=PATIENCE_S) as sensor:
        for _ in range(10):
            sensor.read()
        light.begin()
        for reading in sensor.stream(drop="oldest"):
            now_s = time.monotonic()
            bright = float(reading.frame.pixels[CORNER].mean()) > 127
            on_s = light.on_s[light.on_s < now_s]
            if bright and not before and len(on_s):
                middle_s = next(one for one in light.middles_s if one >= on_s[-1])
                whole.append(now_s - middle_s)
                processing.append(reading.latency_ms / 1e3)
                stamps.append(reading.frame.timestamp_s - middle_s)
            before = bright
            if len(whole) == blinks or now_s > light.ends_s:
                break
    return Latency(np.array(whole), np.array(processing), np.array(stamps))


if __name__ == "__main__":
    main()
