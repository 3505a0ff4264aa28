from pathlib import Path

from tactile_core.testing import PluginConformance

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "relief.png"
LIGHTS = [{"name": f"light{i}", "azimuth_deg": 60 * i, "elevation_deg": 25} for i in range(6)]


class TestCore(PluginConformance):
    plugin = "core"
    options = {  # noqa: RUF012
        "core.replay": {"path": PICTURE, "loop": True},
        "core.sequential": {"lights": LIGHTS, "dark": True},
    }
