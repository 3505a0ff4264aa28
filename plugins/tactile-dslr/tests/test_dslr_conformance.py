from typing import Any, ClassVar

from tactile_core.testing import PluginConformance


class TestDslr(PluginConformance):
    plugin = "dslr"
    options: ClassVar[dict[str, dict[str, Any]]] = {"dslr.camera": {"model": "of no camera"}}
    expected_failures: ClassVar[dict[str, str]] = {
        "opening[camera dslr.camera]": "there is no such camera; see test_dslr_camera.py",
    }
