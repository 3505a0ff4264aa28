"""Writes a trained network: ONNX, manifest and data sheet. This module imports torch."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import torch

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.formats.files import write_atomically
from tactile_core.formats.text import yaml_text
from tactile_core.profiles.model import Profile
from tactile_train.scores import ForceScore


class DataSheet(NamedTuple):
    """What a reader must know about a network.

    Attributes
    ----------
    title, data, command, network : str
        Sentences, and the command that makes the network again.
    licence : str
    scores : sequence of (heading, scores)
    limits : str
    """

    title: str
    data: str
    command: str
    network: str
    licence: str
    scores: Sequence[tuple[str, Sequence[ForceScore]]]
    limits: str

    def markdown(self, sha256: str) -> str:
        """Return the page."""
        tables = [f"## {heading}\n\n{_table(scores)}" for heading, scores in self.scores]
        return (
            "\n\n".join(
                [
                    f"# {self.title}",
                    self.network,
                    f"- licence: {self.licence}\n- sha256: `{sha256}`\n- made by: `{self.command}`",
                    f"## Data\n\n{self.data}",
                    *tables,
                    f"## Limits\n\n{self.limits}",
                ]
            )
            + "\n"
        )


def onnx_bytes(network: Any, planes: int, size: tuple[int, int]) -> bytes:
    """Return a network as an ONNX file for one observation at a time."""
    buffer = BytesIO()
    zeros = torch.zeros(1, planes, size[1], size[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exporter that needs no further package is the old one
        torch.onnx.export(
            network.eval(),
            (zeros,),
            buffer,
            opset_version=13,  # of ONNX: every supported OpenCV knows it
            dynamo=False,
            input_names=["planes"],
            output_names=["wrench"],
        )
    return buffer.getvalue()


def write_network(
    out: Path,
    name: str,
    content: bytes,
    profile: Profile,
    size: tuple[int, int],
    std: tuple[Float64, Float64],
    sheet: DataSheet,
) -> tuple[Path, Path, Path]:
    """Write ``NAME.onnx``, ``NAME.yaml`` and ``NAME.md`` to a folder; return the three paths.

    Parameters
    ----------
    out : Path
    name : str
    content : bytes
        Of the ONNX file.
    profile : Profile
        Of the sensor.
    size : (width, height)
        Of the input in px.
    std : (4,) and (4,) float64
        Standard deviations without load, over the modulus, and for each newton of force.
    sheet : DataSheet
    """
    out.mkdir(parents=True, exist_ok=True)
    sha256 = hashlib.sha256(content).hexdigest()
    image = profile.image
    manifest: dict[str, Any] = {
        "schema": 1,
        "file": f"{name}.onnx",
        "sha256": sha256,
        "licence": sheet.licence,
        "description": sheet.title,
        "image": {
            "width_px": image.width_px,
            "height_px": image.height_px,
            "channels": 3 if image.color == "rgb" else 1,
            "mm_per_px": image.mm_per_px,
        },
        "input": {
            "width_px": size[0],
            "height_px": size[1],
            "planes": [
                {"of": "frame", "background": "difference", "divide_by": "reference_mean"},
                {"of": "reference", "divide_by": "reference_mean", "mean": 1.0},
            ],
        },
        "output": {
            "quantity": "wrench",
            "unit": "N/MPa" if profile.gel.shear_modulus_mpa else "N",
            "names": ["fx", "fy", "fz", "tz"],
            "std": [float(f"{value:.4g}") for value in std[0]],
            "std_share": [float(f"{value:.3g}") for value in std[1]],
        },
    }
    paths = out / f"{name}.onnx", out / f"{name}.yaml", out / f"{name}.md"
    write_atomically(paths[0], content)
    write_atomically(paths[1], yaml_text(manifest).encode())
    write_atomically(paths[2], sheet.markdown(sha256).encode())
    return paths


def _table(scores: Sequence[ForceScore]) -> str:
    lines = [
        "| | samples | R² Fx | Fy | Fz | Tz | RMSE Fx, N | Fy, N | Fz, N | Tz, N·mm |",
        "| --- |" + " --- |" * 9,
    ]
    for one in scores:
        r2 = " | ".join(f"{value:.3f}" for value in one.r2)
        rmse = " | ".join(f"{value:.2f}" for value in one.rmse)
        lines.append(f"| {one.of} | {one.samples} | {r2} | {rmse} |")
    return "\n".join(lines)
