"""Runs ONNX networks with OpenCV or ONNX Runtime."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Literal

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError, LibraryMissing

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
                "'runtime: onnxruntime' needs ONNX Runtime: pip install 'tactile-core[onnx]'"
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


def loaded(content: bytes, name: str, runtime: Runtime) -> LoadedNetwork:
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


def tried(network: LoadedNetwork, tensor: Float32, name: str, outputs: int | None) -> None:
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
