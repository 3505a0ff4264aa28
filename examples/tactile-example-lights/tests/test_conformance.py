import os
from typing import ClassVar

from tactile_core.testing import PluginConformance


class TestExampleLights(PluginConformance):
    plugin = "example_lights"
    options: ClassVar = {"example_lights.journal": {"path": os.devnull}}
