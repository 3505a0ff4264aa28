"""ONNX files of one linear layer, written field by field, and manifests of them."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.formats.text import yaml_text

_FLOAT, _INT = 1, 2
"""Types of a tensor's elements and of an attribute in ONNX."""


def linear_onnx(shape: tuple[int, ...], weights: Array, bias: Array) -> bytes:
    """Return an ONNX file that maps a tensor of this shape to ``weights @ values + bias``."""
    node = _message(4, b"Flatten") + _message(1, b"planes") + _message(2, b"flat")
    axis = _message(1, b"axis") + _number(3, 1) + _number(20, _INT)
    product = b"".join(_message(1, name) for name in (b"flat", b"weights", b"bias"))
    product += _message(2, b"values") + _message(4, b"Gemm")
    turned = _message(1, b"transB") + _number(3, 1) + _number(20, _INT)
    graph = _message(1, node + _message(5, axis)) + _message(1, product + _message(5, turned))
    graph += _message(2, b"linear")
    graph += _message(5, _tensor(b"weights", weights)) + _message(5, _tensor(b"bias", bias))
    graph += _message(11, _value(b"planes", shape))
    graph += _message(12, _value(b"values", (1, len(bias))))
    return _number(1, 7) + _message(7, graph) + _message(8, _message(1, b"") + _number(2, 13))


def written_network(
    folder: Path,
    weights: Array,
    bias: Array,
    *,
    image: tuple[int, int, int],
    input: dict[str, Any],
    output: dict[str, Any],
    planes: int,
    **changed: Any,
) -> Path:
    """Write ``network.onnx`` and its manifest; return the manifest's path.

    Parameters
    ----------
    image : (width, height, channels)
        Of the sensor.
    input, output : dict
        Sections of the manifest.
    planes : int
        Of the input tensor.
    **changed
        Other keys of the manifest.
    """
    order = input.get("order", "nchw")
    size = input["height_px"], input["width_px"]
    shape = (1, planes, *size) if order == "nchw" else (1, *size, planes)
    content = linear_onnx(shape, weights, bias)
    (folder / "network.onnx").write_bytes(content)
    manifest = {
        "schema": 1,
        "file": "network.onnx",
        "sha256": hashlib.sha256(content).hexdigest(),
        "licence": "MIT",
        "image": {"width_px": image[0], "height_px": image[1], "channels": image[2]},
        "input": input,
        "output": output,
    } | changed
    path = folder / "network.yaml"
    path.write_text(yaml_text(manifest))
    return path


def _tensor(name: bytes, values: Array) -> bytes:
    dims = b"".join(_number(1, length) for length in values.shape)
    raw = np.ascontiguousarray(values, "<f4").tobytes()
    return dims + _number(2, _FLOAT) + _message(8, name) + _message(9, raw)


def _value(name: bytes, shape: tuple[int, ...]) -> bytes:
    dims = b"".join(_message(1, _number(1, length)) for length in shape)
    kind = _message(1, _number(1, _FLOAT) + _message(2, dims))
    return _message(1, name) + _message(2, kind)


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _message(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    parts = []
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*parts, value])
