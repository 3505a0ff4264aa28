"""The manifest of a network, and the runtime that runs it."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, Literal, Self

import cv2
import numpy as np
from pydantic import (
    Field,
    FiniteFloat,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    model_validator,
)

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError, LibraryMissing
from tactile_core.formats.yaml_tree import read_mapping
from tactile_core.interfaces.artefact import Section
from tactile_core.interfaces.image import ImageSection

Source = Literal["frame", "reference", "height", "displacement"]
Numbers = FiniteFloat | tuple[FiniteFloat, ...]
PositiveNumbers = PositiveFloat | tuple[PositiveFloat, ...]

WRENCH = ("fx", "fy", "fz", "tz")  # Names of the outputs of a network that estimates a wrench


def _check_length(name: str, given: object, of: tuple[object, ...] | None, what: str) -> None:
    if isinstance(given, tuple) and of is not None and len(given) != len(of):
        raise ValueError(f"{name} has {len(given)} values for {len(of)} {what}")


class SensorImage(Section):
    """The images that the network was trained on, before they are shrunk."""

    width_px: PositiveInt
    height_px: PositiveInt
    channels: PositiveInt = 3  # red, green and blue
    mm_per_px: PositiveFloat | None = Field(
        default=None, description="Scale. Default: any scale is accepted."
    )


class Planes(Section):
    """Planes of the input that come from one quantity."""

    of: Source
    channels: tuple[int, ...] | None = Field(
        default=None, description="Channels to take, in this order. Default: all."
    )
    background: Literal["none", "difference"] = Field(
        default="none", description="difference: subtract the reference."
    )
    divide_by: Literal["one", "full_scale", "reference_mean"] = Field(
        default="one", description="reference_mean: the mean of each channel of the reference."
    )
    mean: Numbers = Field(default=0.0, description="Subtracted after the division.")
    std: PositiveNumbers = Field(default=1.0, description="Divides what remains.")

    @model_validator(mode="after")
    def _is_an_image(self) -> Self:
        image = self.of in ("frame", "reference")
        if not image and (self.background != "none" or self.divide_by != "one"):
            raise ValueError(f"{self.of} has no background and no full scale; leave both out")
        for name in ("mean", "std"):
            _check_length(name, getattr(self, name), self.channels, "channels")
        if self.of == "reference" and self.background == "difference":
            raise ValueError("the reference minus itself is 0; take the frame's difference")
        return self


class NetworkInput(Section):
    """The input tensor."""

    width_px: PositiveInt
    height_px: PositiveInt
    order: Literal["nchw", "nhwc"] = "nchw"
    frames: PositiveInt = Field(default=1, le=64, description="Frames that one input holds.")
    stride: PositiveInt = Field(
        default=1, le=1000, description="Frames from each to the one before; the last is current."
    )
    planes: tuple[Planes, ...] = Field(min_length=1)


class NetworkValues(Section):
    """The output tensor."""

    quantity: Literal["wrench", "vector"]
    unit: str = Field(
        default="",
        description="N, or N/MPa for a force relative to the gel's shear modulus; torques in "
        "N·mm or N·mm/MPa. Any text for a vector.",
    )
    names: tuple[str, ...] = ()
    scale: Numbers = Field(default=1.0, description="Multiplies the network's output.")
    offset: Numbers = Field(default=0.0, description="Added afterwards.")
    std: tuple[NonNegativeFloat, ...] | None = Field(
        default=None, description="Standard deviations without load, in the unit."
    )
    std_share: Numbers = Field(
        default=0.0, description="What is added in squares for each newton of force."
    )

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        if self.quantity == "wrench":
            if sorted(self.names) != sorted(WRENCH):
                raise ValueError(f"a wrench has the names {', '.join(WRENCH)}, in any order")
            if self.unit not in ("N", "N/MPa"):
                raise ValueError(f"the unit of a wrench is N or N/MPa, not {self.unit!r}")
        for name in ("scale", "offset", "std", "std_share"):
            _check_length(name, getattr(self, name), self.names or None, "names")
        return self


class NetworkManifest(Section):
    """Everything that the file of a network does not say itself."""

    schema_: Literal[1] = Field(alias="schema")
    file: str = Field(min_length=1, description="The .onnx, relative to the manifest.")
    sha256: str = Field(pattern="^[0-9a-f]{64}$", description="Of the .onnx.")
    licence: str = Field(min_length=1, description="Under which the network may be used.")
    description: str = ""
    image: SensorImage
    input: NetworkInput
    output: NetworkValues


class NetworkFile:
    """A manifest and the network beside it.

    Parameters
    ----------
    path : Path
        The manifest.

    Raises
    ------
    InputError
        The manifest or the network is absent, or the manifest is invalid.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.manifest = NetworkManifest.model_validate(read_mapping(path))
        except ValidationError as error:
            raise InputError(f"{path}: {_first(error)}") from None
        self.network = path.parent / self.manifest.file
        if not self.network.is_file():
            raise InputError(
                f"{path} names the network {self.manifest.file}, which is not beside it; put the "
                f"file there or correct 'file'"
            )

    def check_image(self, image: ImageSection, channels: int | None = None) -> None:
        """Raise an error if the sensor's images differ from those that the network takes."""
        wanted = self.manifest.image
        size = f"{image.width_px} × {image.height_px}"
        if (image.width_px, image.height_px) != (wanted.width_px, wanted.height_px):
            raise InputError(
                f"{self.path} is for images of {wanted.width_px} × {wanted.height_px} px, and this "
                f"sensor's have {size}; use a network that was trained for this sensor"
            )
        scale = wanted.mm_per_px
        if scale is not None and abs(image.mm_per_px / scale - 1) > 0.02:
            raise InputError(
                f"{self.path} is for {scale:g} mm per pixel, and this sensor has "
                f"{image.mm_per_px:g}; use a network that was trained for this sensor"
            )
        if channels is not None and channels != wanted.channels:
            raise InputError(
                f"{self.path} is for images of {wanted.channels} channels, and this sensor's have "
                f"{channels}; use a network that was trained for this sensor"
            )

    def content(self) -> bytes:
        """Return the bytes of the network.

        Raises
        ------
        InputError
            They are not those that the manifest was written for.
        """
        data = self.network.read_bytes()
        found = hashlib.sha256(data).hexdigest()
        if found != self.manifest.sha256:
            raise InputError(
                f"{self.network} is not the network that {self.path.name} describes: its sha256 "
                f"is {found[:12]}…, not {self.manifest.sha256[:12]}…; restore the file, or write "
                f"the manifest of the new one"
            )
        return data


def _first(error: ValidationError) -> str:
    first: Any = error.errors()[0]
    place = ".".join(map(str, first["loc"]))
    words = str(first["msg"]).removeprefix("Value error, ")
    return f"{place}: {words}" if place else words


Runtime = Literal["opencv", "onnxruntime"]


class LoadedNetwork(ABC):
    """A network in memory."""

    @abstractmethod
    def run(self, tensor: Float32) -> Float32:
        """Return the first output for one input of one observation, as (N,) float32."""


class OpenCvNetwork(LoadedNetwork):
    """A network run by ``cv2.dnn``."""

    def __init__(self, content: bytes, name: str) -> None:
        try:
            self._net: Any = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
            empty = self._net.empty()
        except Exception as error:  # for a damaged file not only cv2.error
            raise InputError(
                f"OpenCV cannot load {name} ({_words(error)}); set 'runtime: onnxruntime' in this "
                f"step, or export the network again, with simpler layers"
            ) from None
        if empty:
            raise InputError(f"{name} holds no network; export it again")

    def run(self, tensor: Float32) -> Float32:
        """Return the first output."""
        self._net.setInput(tensor)
        return np.asarray(self._net.forward(), np.float32).reshape(-1)


class OnnxRuntimeNetwork(LoadedNetwork):
    """A network run by ONNX Runtime on one thread."""

    def __init__(self, content: bytes, name: str) -> None:
        try:
            import onnxruntime
        except ImportError:
            raise LibraryMissing(
                "'runtime: onnxruntime' needs ONNX Runtime: pip install onnxruntime"
            ) from None
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        try:
            self._session: Any = onnxruntime.InferenceSession(
                content, options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # its exceptions have no common base class
            raise InputError(f"ONNX Runtime cannot load {name} ({_words(error)})") from None
        self._input = self._session.get_inputs()[0].name

    def run(self, tensor: Float32) -> Float32:
        """Return the first output."""
        (first, *_) = self._session.run(None, {self._input: tensor})
        return np.asarray(first, np.float32).reshape(-1)


def load_network(content: bytes, name: str, runtime: Runtime) -> LoadedNetwork:
    """Load a network.

    Parameters
    ----------
    content : bytes
        The ONNX file.
    name : str
        Of the file, for messages.
    runtime : "opencv" or "onnxruntime"

    Raises
    ------
    InputError
        The library cannot load it.
    LibraryMissing
        ONNX Runtime is not installed.
    """
    kinds = {"opencv": OpenCvNetwork, "onnxruntime": OnnxRuntimeNetwork}
    network: LoadedNetwork = kinds[runtime](content, name)
    return network


def try_network(network: LoadedNetwork, tensor: Float32, name: str, outputs: int | None) -> None:
    """Run a network once on zeros and raise an error if the shapes do not match.

    Parameters
    ----------
    network : LoadedNetwork
    tensor : float32
        Zeros of the shape that the manifest gives.
    name : str
        Of the manifest, for messages.
    outputs : int or None
        Number of values that the manifest names; None if it names none.

    Raises
    ------
    InputError
        The network takes or gives tensors of another shape.
    """
    shape = " × ".join(map(str, tensor.shape))
    try:
        found = network.run(tensor)
    except Exception as error:  # both libraries raise their own exceptions
        raise InputError(
            f"{name}: the network does not take an input of {shape} ({_words(error)}); correct "
            f"size, order, frames or planes in the manifest"
        ) from None
    if not np.isfinite(found).all():
        raise InputError(
            f"{name}: the network gives values that are not finite, so its weights are not; train "
            f"or export it again"
        )
    if outputs is not None and len(found) != outputs:
        raise InputError(
            f"{name}: the network gives {len(found)} values and the manifest names {outputs}; "
            f"correct output.names"
        )


def _words(error: BaseException) -> str:
    """Return the essence of a library's message, which can have many lines."""
    lines = [line for line in str(error).splitlines() if line.strip()] or [type(error).__name__]
    return " ".join(lines[0].split())[:160]
