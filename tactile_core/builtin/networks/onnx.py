"""Estimator ``core.onnx``: any ONNX network, by the manifest beside it."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, Field

from tactile_core.builtin.networks.manifest import NetworkFile
from tactile_core.builtin.networks.network_step import NetworkStep, Observation
from tactile_core.builtin.networks.runtime import Runtime
from tactile_core.errors import InputError
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    DisplacementField,
    Float32,
    Frame,
    HeightMap,
    NetworkOutput,
    Reference,
)


class Onnx(Estimator):
    """Run a network, for example a backbone that a lab has converted itself.

    The manifest says which quantities the network takes and how they are normalised. A network that
    takes several frames repeats the first until enough have come.
    """

    class Options(device.Options):
        """Options of the step."""

        manifest: Path = Field(description="YAML beside the .onnx.")
        runtime: Runtime = Field(
            default="opencv", description="opencv, or onnxruntime from the extra onnx."
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        file = NetworkFile(options.manifest)
        if file.manifest.output.quantity != "vector":
            raise InputError(
                f"core.onnx gives a vector and {options.manifest} describes a wrench; "
                f"use core.force_cnn for it"
            )
        self._step = NetworkStep(file, context.image, options.runtime)

    def open(self) -> None:
        """Load the network."""
        self._step.open()

    def close(self) -> None:
        """Free the network."""
        self._step.close()

    def reset(self) -> None:
        """Forget earlier frames."""
        self._step.reset()

    def estimate(
        self,
        frame: Frame,
        reference: Reference,
        height: HeightMap | None,
        displacement: DisplacementField | None,
    ) -> NetworkOutput:
        """Return the network's output."""
        found: Float32 = self._step.run(Observation(frame, reference, height, displacement)).astype(
            "float32"
        )
        output = self._step.manifest.output
        return NetworkOutput(found, output.names, output.unit, frame.timestamp_s)
