"""TouchNet of py3DCal: convolutions turn an image and its background into slopes.

The state of the network has layers ``conv1`` to ``conv9``, each but the last followed by a batch
normalisation, ``bn1`` to ``bn8``, and ReLU. All keep the size of the image and take zeros beyond
its border. Inputs are the change of red, green and blue against the background, as shares of the
full scale, and column and row in px, counted from 1. Outputs are the slopes of the depth by which
an object presses, counted downwards.

py3DCal mirrors each image left to right as it takes it, so the network sees, and measures, mirrored
images. It stores a GelSight Mini's images as red, green, blue; those of a DIGIT it passes on in
OpenCV's order, so that a network that was trained on them sees blue first.

References
----------
.. [1] py3DCal (MIT licence), class ``TouchNet`` and functions ``get_depthmap``,
   ``add_coordinate_embeddings`` and ``precompute_gradients``.
.. [2] S. Ioffe and C. Szegedy, "Batch Normalization: Accelerating Deep Network Training by Reducing
   Internal Covariate Shift", ICML 2015, algorithm 2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.importer import Importer
from tactile_core.interfaces.slope_models.model_file import Arrays
from tactile_core.interfaces.slope_models.samples import ImageShape
from tactile_core.quantities import Float32, Frame, Reference
from tactile_imports.slope_image import COLOURS, SlopeImageModel, colour_shape
from tactile_imports.torch_file import read_torch_file

_CHANNELS = (5, 32, 64, 128, 256, 256, 128, 64, 32, 2)  # Before and after each layer
_SIDES_PX = (7, 7, 7, 5, 5, 5, 3, 3, 1)  # Of the kernels
_EPSILON = 1e-5  # PyTorch's default of a batch normalisation, which its state does not hold


@dataclass(frozen=True, eq=False)
class Convolutions:
    """Convolutions with ReLU between them; each takes zeros beyond the border.

    Attributes
    ----------
    kernels : sequence of (B, A, k, k) float32
    biases : sequence of (B,) float32
    """

    kernels: Sequence[Float32]
    biases: Sequence[Float32]

    def __call__(self, image: Float32) -> Float32:
        """Map (A, H, W) to (B, H, W)."""
        for kernel, bias in zip(self.kernels[:-1], self.biases[:-1], strict=True):
            image = np.maximum(convolve(image, kernel, bias), 0)
        return convolve(image, self.kernels[-1], self.biases[-1])

    def arrays(self) -> dict[str, Float32]:
        """Return kernels and biases by name."""
        return {
            f"{part}_{number}": array
            for part, arrays in (("kernel", self.kernels), ("bias", self.biases))
            for number, array in enumerate(arrays, 1)
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> Self:
        """Rebuild TouchNet's layers.

        Raises
        ------
        LookupError, TypeError, ValueError
            An array is missing, has another shape, or is not finite.
        """
        kernels, biases = [], []
        for number, shape in enumerate(_shapes(), 1):
            kernels.append(_array(arrays, f"kernel_{number}", shape))
            biases.append(_array(arrays, f"bias_{number}", shape[:1]))
        return cls(kernels, biases)

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """Return the layers of a PyTorch state, with the normalisation in kernels and biases.

        Raises
        ------
        LookupError, TypeError, ValueError
            As :meth:`from_arrays`.
        """
        kernels, biases = [], []
        for number, shape in enumerate(_shapes(), 1):
            kernel = _array(state, f"conv{number}.weight", shape)
            bias = _array(state, f"conv{number}.bias", shape[:1])
            if number < len(_SIDES_PX):
                gain, offset, mean, variance = (
                    _array(state, f"bn{number}.{part}", shape[:1])
                    for part in ("weight", "bias", "running_mean", "running_var")
                )
                if variance.min() < 0:
                    raise ValueError("a variance is negative")
                gain = gain / np.sqrt(variance + np.float32(_EPSILON))
                kernel, bias = kernel * gain[:, None, None, None], (bias - mean) * gain + offset
            kernels.append(kernel)
            biases.append(bias)
        return cls(kernels, biases)


def convolve(image: Float32, kernel: Float32, bias: Float32) -> Float32:
    """Correlate an image with a kernel at each pixel, as a convolutional network does.

    Parameters
    ----------
    image : (A, H, W) float32
        Taken as zero beyond its border.
    kernel : (B, A, k, k) float32
        With an odd side.
    bias : (B,) float32

    Returns
    -------
    (B, H, W) float32
    """
    side, (_, height, width) = kernel.shape[2], image.shape
    margin = side // 2
    padded = np.pad(image, ((0, 0), (margin, margin + 1), (margin, margin)))
    row = width + 2 * margin
    # rows one after another: a step right or down is then a shift of all pixels at once, and a
    # convolution a sum of matrix products, with some columns too many on the right
    flat = padded.reshape(len(image), -1)
    pixels = height * row
    total = np.repeat(bias[:, None], pixels, axis=1)
    product = np.empty_like(total)
    for down, right in np.ndindex(side, side):
        shift = down * row + right
        weights = np.ascontiguousarray(kernel[:, :, down, right])
        total += np.matmul(weights, flat[:, shift : shift + pixels], out=product)
    return total.reshape(-1, height, row)[:, :, :width]


class TouchNetwork(SlopeImageModel):
    """Slopes by TouchNet [1]_.

    Parameters
    ----------
    network : Convolutions
    shape : (H, W, 3)
        Shape of the images; the network sees positions in px.
    """

    def __init__(self, network: Convolutions, shape: ImageShape) -> None:
        self.network, self.shape = network, shape

    def _slopes(self, frame: Frame, reference: Reference) -> Float32:
        height, width, _ = self.shape
        inputs = np.empty((COLOURS + 2, height, width), np.float32)
        inputs[:COLOURS] = np.moveaxis(frame.pixels - reference.pixels, 2, 0)[:, :, ::-1]
        inputs[:COLOURS] /= frame.full_scale
        inputs[COLOURS] = np.arange(1, width + 1)
        inputs[COLOURS + 1] = np.arange(1, height + 1)[:, None]
        x, y = self.network(inputs)[:, :, ::-1]
        return np.stack([x, -y])  # our heights rise where an object presses; x was mirrored as well

    def _arrays(self) -> Arrays:
        return self.network.arrays()

    @classmethod
    def _from_arrays(cls, arrays: Arrays, shape: ImageShape) -> Self:
        return cls(Convolutions.from_arrays(arrays), shape)


class TouchNetworkImporter(Importer):
    """Reads the weights of a network that sees red, green, blue, as of a GelSight Mini."""

    order: ClassVar[Literal["rgb", "bgr"]] = "rgb"

    def read(self, path: Path, build: SensorBuild) -> TouchNetwork:
        """Return the network in the file; see :meth:`Importer.read`."""
        state = read_torch_file(path)
        try:
            network = Convolutions.from_state(state)
        except (LookupError, TypeError, ValueError) as error:
            raise InputError(
                f"{path} holds no network like py3DCal's TouchNet, of layers conv1 to conv9 and "
                "bn1 to bn8; give such a file, or another importer with --as"
            ) from error
        if self.order == "bgr":
            network.kernels[0][:, :COLOURS] = network.kernels[0][:, COLOURS - 1 :: -1].copy()
        return TouchNetwork(network, colour_shape(build))


class TouchNetworkBgrImporter(TouchNetworkImporter):
    """Reads the weights of a network that sees blue, green, red, as of a DIGIT."""

    order = "bgr"


def _shapes() -> list[tuple[int, int, int, int]]:
    """Return the shape of each kernel, (B, A, k, k)."""
    layers = zip(_CHANNELS[1:], _CHANNELS[:-1], _SIDES_PX, strict=True)
    return [(after, before, side, side) for after, before, side in layers]


def _array(arrays: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> NDArray[np.float32]:
    array = np.array(arrays[name], np.float32)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{name} has another shape, or is not finite")
    return array
