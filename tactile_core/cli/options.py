"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

ProfileName: TypeAlias = Annotated[
    str, typer.Argument(metavar="PROFILE", help="A profile's name or the path of its YAML file.")
]
AsJson: TypeAlias = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Serial: TypeAlias = Annotated[str | None, typer.Option(help="Serial of the physical unit.")]
GelName: TypeAlias = Annotated[str | None, typer.Option(help="Name of the gel on the unit.")]
Simulated: TypeAlias = Annotated[bool, typer.Option("--sim", help="Use the virtual sensor.")]
Script: TypeAlias = Annotated[
    Path | None, typer.Option(help="With --sim: YAML of the indenter and its motion.")
]
ReferencePath: TypeAlias = Annotated[
    str | None,
    typer.Option(
        help="The sensor with no contact: a path, 'first' frame, or 'median' of the recording."
    ),
]
BundlePath: TypeAlias = Annotated[
    Path | None, typer.Option(help="Calibration bundle. Default: the bundle of the unit.")
]
MostFrames: TypeAlias = Annotated[
    int | None, typer.Option(min=1, help="Stop after this number of frames.")
]
TimeoutS: TypeAlias = Annotated[
    float, typer.Option(help="Longest wait for an image of a live camera, s.")
]
ReconnectS: TypeAlias = Annotated[
    float,
    typer.Option(help="How long to try to open an unplugged camera or light box again, s."),
]
