from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from tactile_example_arm.workpiece import ArmPose

from tactile_core import Quantity
from tactile_core.testing import PluginConformance
from tactile_core.testing.virtual_presses import VirtualPress


class TestExampleArm(PluginConformance):
    plugin = "example_arm"
    options: ClassVar = {"example_arm.log": {"path": "/dev/null"}}

    def inputs(self, scene: VirtualPress) -> Mapping[type[Quantity], Quantity]:
        """Return the arm's pose, which no step of the core computes."""
        return {ArmPose: ArmPose(np.zeros(3, np.float32), np.eye(3, dtype=np.float32))}
