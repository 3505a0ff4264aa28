"""The components of the core pass the conformance suite."""

import atexit
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import numpy as np
import pytest
from support.light_box import LIGHTS as BOX_LIGHTS
from support.light_box import light_box
from support.mjpeg_server import Exchange, MjpegServer, jpeg
from support.usb_bus import UsbBus
from support.usb_light_box import UsbLightBox

from tactile_core.builtin.force_linear import FEATURES, LinearForceModel
from tactile_core.builtin.leds.usb_leds import UsbLeds
from tactile_core.quantities import Quantity
from tactile_core.testing import PluginConformance
from tactile_core.testing.virtual_presses import VirtualPress

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "relief.png"
LIGHTS = [{"name": f"light{i}", "azimuth_deg": 60 * i, "elevation_deg": 25} for i in range(6)]

FOLDER = TemporaryDirectory()
atexit.register(FOLDER.cleanup)
for number in range(8):
    Path(FOLDER.name, f"{number}.png").write_bytes(PICTURE.read_bytes())


def stream(exchange: Exchange) -> None:
    """Send an image a hundredth of a second."""
    exchange.begin()
    number = 0
    while not exchange.stopped.wait(0.01):
        exchange.send_image(jpeg(number % 256))
        number += 1


SERVER = MjpegServer(stream)


class TestCore(PluginConformance):
    plugin = "core"
    options: ClassVar[dict[str, dict[str, Any]]] = {
        "core.folder": {"path": FOLDER.name, "existing": True},
        "core.replay": {"path": PICTURE, "loop": True},
        "core.sequential": {"lights": LIGHTS, "dark": True},
        "core.serial_leds": {"lights": BOX_LIGHTS, "timeout_s": 2.0},
        "core.stream": {"url": SERVER.url},
        "core.usb_leds": {"lights": BOX_LIGHTS},
        "core.uvc": {"serial": "of no camera"},
        "core.uvc_leds": {"lights": BOX_LIGHTS},
    }
    expected_failures = {  # noqa: RUF012
        "readings[sink core.record]": "there is no sensor; see pipeline/test_record.py",
        "opening[camera core.uvc]": "there is no such webcam; see tests/hardware",
    }

    def inputs(self, scene: VirtualPress) -> Mapping[type[Quantity], Quantity]:
        """Return a force model that was fitted to the indented volume."""
        used = np.array([name == "volume" for name in FEATURES])
        weights = np.tile(used.astype(float), (4, 1))
        return {LinearForceModel: LinearForceModel(weights, np.full((4, 2), 0.1), used)}


@pytest.fixture(scope="module", autouse=True)
def devices() -> Iterator[None]:
    with SERVER, light_box() as box:
        TestCore.options["core.serial_leds"]["port"] = box.port
        UsbLeds.backend = UsbBus(UsbLightBox())
        yield
        UsbLeds.backend = None
