"""Estimator ``core.force_cnn``: force and torque from the image by a trained network."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.builtin.networks.manifest import WRENCH, NetworkFile, Runtime
from tactile_core.builtin.networks.network_step import NetworkStep, Observation
from tactile_core.errors import InputError
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import DisplacementField, Frame, HeightMap, Reference, Wrench

# Networks that come with the profiles; `sensor_profiles/networks` holds their data sheets.
Shipped = Literal["hex_fingertip_virtual"]


class ForceNetwork(Estimator):
    """Estimate the load with a network that ``tactile train-force`` or a lab has trained [1]_.

    A network whose unit is N/MPa estimates the force relative to the gel's shear modulus, which no
    image shows; the modulus of the profile scales it.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
       Estimating Geometry and Force", Sensors 17(12), 2017, section 5.2.
    """

    class Options(device.Options):
        """Options of the step."""

        manifest: Path | Shipped = Field(
            description="YAML beside the .onnx, or the name of a network that is shipped."
        )
        runtime: Runtime = Field(
            default="opencv", description="opencv, or onnxruntime from the extra onnx."
        )

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        file = NetworkFile(_path(options.manifest))
        output = file.manifest.output
        if output.quantity != "wrench":
            raise InputError(
                f"core.force_cnn needs a network that gives a wrench, and {file.path} describes a "
                f"{output.quantity}; use core.onnx for it"
            )
        if file.manifest.input.frames > 1:
            raise InputError(
                f"core.force_cnn takes one frame at a time, and {file.path} asks for "
                f"{file.manifest.input.frames}; use core.onnx for it"
            )
        self._step = NetworkStep(file, context.image, options.runtime)
        self._per_mpa = 1.0
        if output.unit == "N/MPa":
            modulus = context.gel.shear_modulus_mpa
            if modulus is None:
                raise InputError(
                    "core.force_cnn estimates force relative to the gel's stiffness: give "
                    "gel.shear_modulus_mpa in the profile, or leave this step out"
                )
            self._per_mpa = modulus
        self._order = [output.names.index(name) for name in WRENCH]
        self.reset()

    def open(self) -> None:
        """Load the network."""
        self._step.open()

    def close(self) -> None:
        """Free the network."""
        self._step.close()

    def reset(self) -> None:
        """Forget the tare."""
        self._zero, self._last = np.zeros(4), np.zeros(4)

    def tare(self, result: Wrench) -> Wrench:
        """Subtract the present load from all later ones."""
        self._zero = self._last
        return self._wrench(np.zeros(4), result.timestamp_s)

    def estimate(
        self,
        frame: Frame,
        reference: Reference,
        height: HeightMap | None,
        displacement: DisplacementField | None,
    ) -> Wrench:
        """Return the load."""
        seen = Observation(frame, reference, height, displacement)
        self._last = self._step.run(seen)[self._order] * self._per_mpa
        return self._wrench(self._last - self._zero, frame.timestamp_s)

    def _wrench(self, values: Float64, timestamp_s: float) -> Wrench:
        output = self._step.manifest.output
        std = None
        if output.std is not None:
            floor = np.array(output.std)[self._order] * self._per_mpa
            share = np.broadcast_to(output.std_share, 4)[self._order]
            std = np.hypot(floor, share * np.linalg.norm(self._last[:3]))
        return Wrench.from_values(values, std, timestamp_s)


def _path(manifest: Path | str) -> Path:
    if manifest in get_args(Shipped):
        return Path(str(files("sensor_profiles"))) / "networks" / f"{manifest}.yaml"
    return Path(manifest)
