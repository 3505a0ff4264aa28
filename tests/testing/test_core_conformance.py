from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest
from support.light_box import LIGHTS as BOX_LIGHTS
from support.light_box import light_box
from support.usb_bus import UsbBus
from support.usb_light_box import UsbLightBox

from tactile_core.builtin.leds.usb_leds import UsbLeds
from tactile_core.testing import PluginConformance

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "relief.png"
LIGHTS = [{"name": f"light{i}", "azimuth_deg": 60 * i, "elevation_deg": 25} for i in range(6)]


class TestCore(PluginConformance):
    plugin = "core"
    options: ClassVar[dict[str, dict[str, Any]]] = {
        "core.replay": {"path": PICTURE, "loop": True},
        "core.sequential": {"lights": LIGHTS, "dark": True},
        "core.serial_leds": {"lights": BOX_LIGHTS, "timeout_s": 2.0},
        "core.usb_leds": {"lights": BOX_LIGHTS},
        "core.uvc_leds": {"lights": BOX_LIGHTS},
    }


@pytest.fixture(scope="module", autouse=True)
def boxes() -> Iterator[None]:
    with light_box() as box:
        TestCore.options["core.serial_leds"]["port"] = box.port
        UsbLeds.backend = UsbBus(UsbLightBox())
        yield
        UsbLeds.backend = None
