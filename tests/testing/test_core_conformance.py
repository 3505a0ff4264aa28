"""The components of the core pass the conformance suite."""

import atexit
from pathlib import Path
from tempfile import TemporaryDirectory

from tactile_core.testing import PluginConformance

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "relief.png"
LIGHTS = [{"name": f"light{i}", "azimuth_deg": 60 * i, "elevation_deg": 25} for i in range(6)]

FOLDER = TemporaryDirectory()
atexit.register(FOLDER.cleanup)
for number in range(8):
    Path(FOLDER.name, f"{number}.png").write_bytes(PICTURE.read_bytes())


class TestCore(PluginConformance):
    plugin = "core"
    options = {  # noqa: RUF012
        "core.folder": {"path": FOLDER.name, "existing": True},
        "core.replay": {"path": PICTURE, "loop": True},
        "core.sequential": {"lights": LIGHTS, "dark": True},
    }
