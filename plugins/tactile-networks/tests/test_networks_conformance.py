import atexit
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import numpy as np
from support.onnx_network import written_network

from tactile_core.acquisition.devices import make_lights
from tactile_core.testing import PluginConformance
from tactile_core.testing.virtual_presses import generic_rig

FOLDER = TemporaryDirectory()
atexit.register(FOLDER.cleanup)


def network(name: str, **output: Any) -> Path:
    """Write a network that gives the mean colour of the frame's difference to the reference."""
    folder = Path(FOLDER.name, name)
    folder.mkdir()
    profile = generic_rig().profile
    image, channels = profile.image, len(make_lights(profile).channels)
    return written_network(
        folder,
        np.ones((4, channels), np.float32),
        np.zeros(4, np.float32),
        image=(image.width_px, image.height_px, channels),
        input={
            "width_px": 1,
            "height_px": 1,
            "planes": [{"of": "frame", "background": "difference"}],
        },
        output=output,
        planes=channels,
    )


WRENCH = {"quantity": "wrench", "unit": "N", "names": ["fx", "fy", "fz", "tz"]}


class TestNetworks(PluginConformance):
    plugin = "networks"
    options: ClassVar[dict[str, dict[str, Any]]] = {
        "networks.force_cnn": {"manifest": network("force", **WRENCH)},
        "networks.onnx": {"manifest": network("vector", quantity="vector")},
    }
