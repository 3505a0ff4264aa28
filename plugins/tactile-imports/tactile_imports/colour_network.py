"""Networks of gs_sdk and of gsrobotics: the colour and position of a pixel give its slopes.

Both are perceptrons of four layers, ``fc1`` to ``fc4``, with ReLU between them. Their inputs are
the three colours in OpenCV's order blue, green, red, as shares of the full scale, and the position
as shares of the image. They differ in width, in the order of the position, and in what they put
out.

References
----------
.. [1] gs_sdk, class ``Reconstructor``; gelslam and vistac_sdk use the same file, ``nnmodel.pth``.
.. [2] gsrobotics, class ``Reconstruction3D``, whose file is ``nnmini.pt``.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.for_reference import ForReference
from tactile_core.interfaces.importer import Importer
from tactile_core.interfaces.slope_models.model_file import Arrays
from tactile_core.interfaces.slope_models.samples import ImageShape
from tactile_core.quantities import Float32, Frame, Reference
from tactile_imports.slope_image import STEEPEST, SlopeImageModel, colour_shape
from tactile_imports.torch_file import read_torch_file

_BLOCK = 4096  # [count] Pixels that are evaluated together and stay in the cache
_LAYERS = ("fc1", "fc2", "fc3", "fc4")


@dataclass(frozen=True, eq=False)
class Perceptron:
    """Layers with ReLU between them.

    Attributes
    ----------
    weights : sequence of (B, A) float32
    biases : sequence of (B,) float32
    """

    weights: Sequence[Float32]
    biases: Sequence[Float32]

    def __call__(self, features: Float32) -> Float32:
        """Map (A, N) features to (B, N) outputs."""
        out = np.empty((len(self.biases[-1]), features.shape[1]), np.float32)
        for start in range(0, features.shape[1], _BLOCK):
            z = features[:, start : start + _BLOCK]
            for weights, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
                z = weights @ z
                z += bias[:, None]
                np.maximum(z, 0, out=z)
            out[:, start : start + _BLOCK] = self.weights[-1] @ z + self.biases[-1][:, None]
        return out

    def arrays(self) -> dict[str, Float32]:
        """Return weights and biases by the names that PyTorch gives them."""
        return {
            f"{layer}.{part}": array
            for part, arrays in (("weight", self.weights), ("bias", self.biases))
            for layer, array in zip(_LAYERS, arrays, strict=True)
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any], widths: Sequence[int]) -> Self:
        """Rebuild a network of these numbers of inputs, hidden units and outputs.

        Raises
        ------
        LookupError, TypeError, ValueError
            An array is missing, has another shape, or is not finite.
        """
        weights, biases = (
            [np.asarray(arrays[f"{layer}.{part}"], np.float32) for layer in _LAYERS]
            for part in ("weight", "bias")
        )
        shapes = [(after, before) for before, after in pairwise(widths)]
        if [each.shape for each in weights] != shapes or [each.shape for each in biases] != [
            (after,) for after, _ in shapes
        ]:
            raise ValueError("a layer has another size")
        if not all(np.isfinite(each).all() for each in (*weights, *biases)):
            raise ValueError("a weight is not finite")
        return cls(weights, biases)


class ColourNetwork(SlopeImageModel):
    """Slopes by a network of another program, relative to those that it sees in the reference.

    Attributes
    ----------
    widths : tuple of int
        Numbers of inputs, hidden units and outputs of the network.

    Parameters
    ----------
    network : Perceptron
    shape : (H, W, 3)
        Shape of the images; the network sees positions as shares of it.
    """

    widths: ClassVar[tuple[int, ...]]

    def __init__(self, network: Perceptron, shape: ImageShape) -> None:
        self.network, self.shape = network, shape
        self._undeformed = ForReference(self._slopes_of_reference)

    @abstractmethod
    def _order(self, x: Float32, y: Float32) -> tuple[Float32, Float32]:
        """Return the two shares of the image in the order of the network's inputs."""

    @abstractmethod
    def _tangents(self, outputs: Float32) -> Float32:
        """Turn outputs (2, N) into slopes (2, N), ∂z/∂x and ∂z/∂y."""

    def _slopes(self, frame: Frame, reference: Reference) -> Float32:
        return self._slopes_of(frame) - self._undeformed(reference)

    def _slopes_of(self, image: Frame | Reference) -> Float32:
        height, width, _ = self.shape
        y, x = (at.astype(np.float32) for at in np.indices((height, width)))
        features = np.empty((5, height, width), np.float32)
        features[:3] = np.moveaxis(image.pixels, 2, 0)[::-1]  # blue, green, red
        features[:3] /= image.full_scale
        features[3:] = self._order(x / np.float32(width), y / np.float32(height))
        outputs = self.network(features.reshape(5, -1))
        return self._tangents(outputs).reshape(2, height, width)

    def _slopes_of_reference(self, reference: Reference) -> Float32:
        return self._slopes_of(reference)

    def _arrays(self) -> Arrays:
        return self.network.arrays()

    @classmethod
    def _from_arrays(cls, arrays: Arrays, shape: ImageShape) -> Self:
        return cls(Perceptron.from_arrays(arrays, cls.widths), shape)


class AngleNetwork(ColourNetwork):
    """A network of gs_sdk [1]_: 32 hidden units; the outputs are angles of slope, in radians.

    There, heights decrease where an object presses, so that the slopes change their sign.
    """

    widths = (5, 32, 32, 32, 2)

    def _order(self, x: Float32, y: Float32) -> tuple[Float32, Float32]:
        return x, y

    def _tangents(self, outputs: Float32) -> Float32:
        steepest = np.float32(
            np.arctan(STEEPEST)
        )  # beyond a right angle, the tangent would change its sign
        return -np.tan(np.clip(outputs, -steepest, steepest))


class NormalNetwork(ColourNetwork):
    """A network of gsrobotics [2]_: 64 hidden units; the outputs are nx, ny of the unit normal."""

    widths = (5, 64, 64, 64, 2)

    def _order(self, x: Float32, y: Float32) -> tuple[Float32, Float32]:
        return y, x

    def _tangents(self, outputs: Float32) -> Float32:
        # a normal longer than 1 has no component z: what is steeper than we measure
        nz2 = np.maximum(1 - (outputs**2).sum(axis=0), np.float32(1 / (1 + STEEPEST**2)))
        return np.asarray(-outputs / np.sqrt(nz2))


class AngleNetworkImporter(Importer):
    """Reads ``nnmodel.pth`` of gs_sdk, gelslam or vistac_sdk."""

    def read(self, path: Path, build: SensorBuild) -> AngleNetwork:
        """Return the network in the file; see :meth:`Importer.read`."""
        network = _network(path, read_torch_file(path), AngleNetwork.widths, "gs_sdk's nnmodel.pth")
        return AngleNetwork(network, colour_shape(build))


class NormalNetworkImporter(Importer):
    """Reads ``nnmini.pt`` of gsrobotics."""

    def read(self, path: Path, build: SensorBuild) -> NormalNetwork:
        """Return the network in the file; see :meth:`Importer.read`."""
        saved = read_torch_file(path)
        state = saved.get("state_dict") if isinstance(saved, Mapping) else None
        network = _network(path, state, NormalNetwork.widths, "gsrobotics' nnmini.pt")
        return NormalNetwork(network, colour_shape(build))


def _network(path: Path, state: Any, widths: Sequence[int], what: str) -> Perceptron:
    try:
        return Perceptron.from_arrays(state, widths)
    except (LookupError, TypeError, ValueError) as error:
        sizes = "-".join(map(str, widths))
        raise InputError(
            f"{path} holds no network like that in {what}: layers fc1 to fc4 of {sizes} units; "
            "give such a file, or another importer with --as"
        ) from error
