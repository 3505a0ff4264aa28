"""``networks.onnx`` and ``networks.force_cnn``: steps that run a network."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.types import Array, Float32, Float64
from tactile_core.errors import InputError
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import (
    DisplacementField,
    Frame,
    HeightMap,
    NetworkOutput,
    Reference,
    Wrench,
)
from tactile_networks.manifest import (
    WRENCH,
    LoadedNetwork,
    NetworkFile,
    Numbers,
    Planes,
    Runtime,
    Source,
    load_network,
    try_network,
)
from tactile_networks.planes import normalise_planes, shrunk_planes, tensor


class NetworkInputs:
    """The quantities of one frame that a network can take."""

    def __init__(
        self,
        frame: Frame,
        reference: Reference,
        height: HeightMap | None = None,
        displacement: DisplacementField | None = None,
    ) -> None:
        self.frame, self.reference = frame, reference
        self._others: dict[Source, Array | None] = {
            "height": None if height is None else height.mm,
            "displacement": None if displacement is None else displacement.cells_mm,
        }

    def other(self, source: Source, step: str) -> Array:
        """Return the (H, W) heights or the (H, W, 2) displacement."""
        found = self._others[source]
        if found is None:
            raise InputError(
                f"{step} takes {source}, which this sensor does not measure; calibrate it and put "
                f"the {source} step before this one, or use another network"
            )
        return found


class NetworkStep:
    """A network with its manifest, for one sensor.

    Parameters
    ----------
    file : NetworkFile
    image : ImageSection
        Of the sensor.
    runtime : "opencv" or "onnxruntime"

    Raises
    ------
    InputError
        The network is for another size or scale of image.
    """

    def __init__(self, file: NetworkFile, image: ImageSection, runtime: Runtime) -> None:
        file.check_image(image)
        self._file, self._runtime = file, runtime
        self.manifest = file.manifest
        given = self.manifest.input
        self._size = given.width_px, given.height_px
        self._network: LoadedNetwork | None = None
        self._reference: tuple[Reference, Float32, Float32] | None = None
        self._earlier: deque[Sequence[Float32]] = deque(
            maxlen=1 + (given.frames - 1) * given.stride
        )

    def open(self) -> None:
        """Load the network and run it once on zeros."""
        if self._network is not None:
            return
        network = load_network(self._file.content(), self._file.network.name, self._runtime)
        given, names = self.manifest.input, self.manifest.output.names
        depth = given.frames * sum(map(self._depth, given.planes))
        zeros = np.zeros((given.height_px, given.width_px, depth), np.float32)
        try_network(network, tensor([zeros], given.order), self._file.path.name, len(names) or None)
        self._network = network

    def close(self) -> None:
        """Free the network."""
        self._network = None

    def __getstate__(self) -> dict[str, Any]:
        # a copy in another process loads the network itself
        return {**vars(self), "_network": None}

    def reset(self) -> None:
        """Forget earlier frames."""
        self._earlier.clear()

    def run(self, seen: NetworkInputs) -> Float64:
        """Return the network's values for this frame, scaled as the manifest says."""
        self._file.check_image(self._image_of(seen.frame), channels=seen.frame.pixels.shape[2])
        if self._network is None:
            self.open()
        assert self._network is not None
        groups = [self._planes(planes, seen) for planes in self.manifest.input.planes]
        found = self._network.run(tensor(self._with_earlier(groups), self.manifest.input.order))
        output = self.manifest.output
        scaled = found.astype(np.float64) * np.asarray(output.scale) + np.asarray(output.offset)
        return np.asarray(scaled, np.float64)

    def _image_of(self, frame: Frame) -> ImageSection:
        height, width = frame.pixels.shape[:2]
        return ImageSection(width_px=width, height_px=height, mm_per_px=frame.mm_per_px)

    def _with_earlier(self, groups: list[Float32]) -> list[Float32]:
        """Return the planes of all frames of the input, the earliest first.

        Before enough frames have come, the first one stands for those before it.
        """
        given = self.manifest.input
        if given.frames == 1:
            return groups
        self._earlier.append(groups)
        last = len(self._earlier) - 1
        ages = range((given.frames - 1) * given.stride, -1, -given.stride)
        return [plane for age in ages for plane in self._earlier[max(0, last - age)]]

    def _planes(self, planes: Planes, seen: NetworkInputs) -> Float32:
        if planes.of in ("frame", "reference"):
            small, means = self._small_reference(seen.reference)
            found = small if planes.of == "reference" else self._small(seen.frame.pixels)
            if planes.background == "difference":
                found = found - small
            divisor: Float32 | float = 1.0
            if planes.divide_by == "full_scale":
                divisor = seen.frame.full_scale
            elif planes.divide_by == "reference_mean":
                divisor = means
            found = normalise_planes(found, divisor)
        else:
            found = self._small(seen.other(planes.of, self._file.path.name))
        if planes.channels is not None:
            found = found[..., list(planes.channels)]
        return normalise_planes(found, 1.0, _several(planes.mean), _several(planes.std))

    def _small(self, values: Array) -> Float32:
        return shrunk_planes(values, self._size)

    def _small_reference(self, reference: Reference) -> tuple[Float32, Float32]:
        kept = self._reference
        if kept is None or kept[0] is not reference:
            small = self._small(reference.pixels)
            means = np.maximum(small.mean((0, 1)), np.float32(1e-6 * reference.full_scale))
            kept = self._reference = reference, small, np.asarray(means, np.float32)
        return kept[1], kept[2]

    def _depth(self, planes: Planes) -> int:
        if planes.channels is not None:
            return len(planes.channels)
        return {"height": 1, "displacement": 2}.get(planes.of, self.manifest.image.channels)


def _several(numbers: Numbers) -> Sequence[float] | float:
    return list(numbers) if isinstance(numbers, tuple) else numbers


class Onnx(Estimator):
    """Run a network, for example a backbone that a lab has converted itself.

    The manifest says which quantities the network takes and how they are normalised. A network that
    takes several frames repeats the first until enough have come.
    """

    class Options(device.Options):
        """Options of the step."""

        manifest: Path = Field(description="YAML beside the .onnx.")
        runtime: Runtime = Field(
            default="opencv", description="opencv, or onnxruntime from the extra of that name."
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        file = NetworkFile(options.manifest)
        if file.manifest.output.quantity != "vector":
            raise InputError(
                f"networks.onnx gives a vector and {options.manifest} describes a wrench; "
                f"use networks.force_cnn for it"
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
        found: Float32 = self._step.run(
            NetworkInputs(frame, reference, height, displacement)
        ).astype("float32")
        output = self._step.manifest.output
        return NetworkOutput(found, output.names, output.unit, frame.timestamp_s)


# Networks that come with the package; `shipped` holds their data sheets.
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
            default="opencv", description="opencv, or onnxruntime from the extra of that name."
        )

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        file = NetworkFile(_path(options.manifest))
        output = file.manifest.output
        if output.quantity != "wrench":
            raise InputError(
                f"networks.force_cnn needs a network that gives a wrench, and {file.path} "
                f"describes a {output.quantity}; use networks.onnx for it"
            )
        if file.manifest.input.frames > 1:
            raise InputError(
                f"networks.force_cnn takes one frame at a time, and {file.path} asks for "
                f"{file.manifest.input.frames}; use networks.onnx for it"
            )
        self._step = NetworkStep(file, context.image, options.runtime)
        self._per_mpa = 1.0
        if output.unit == "N/MPa":
            modulus = context.gel.shear_modulus_mpa
            if modulus is None:
                raise InputError(
                    "networks.force_cnn estimates force relative to the gel's stiffness: give "
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
        seen = NetworkInputs(frame, reference, height, displacement)
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
        return Path(str(files("tactile_networks"))) / "shipped" / f"{manifest}.yaml"
    return Path(manifest)
