from typing import Any, ClassVar

from tactile_core.testing import PluginConformance


class TestGenicam(PluginConformance):
    plugin = "genicam"
    options: ClassVar[dict[str, dict[str, Any]]] = {"genicam.camera": {"serial": "of no camera"}}
    expected_failures: ClassVar[dict[str, str]] = {
        "opening[camera genicam.camera]": "there is no such camera; see test_genicam_camera.py",
    }
