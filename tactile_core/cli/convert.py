"""``tactile convert``: one kind of recording into another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson
from tactile_core.cli.output import print_data, print_json, print_message


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="IN",
            help="A recording (.mcap, .h5 or its folder), or images or a video with --profile.",
        ),
    ],
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="New: .mcap, .h5, a name without ending for a folder of images, .rrd, or the "
            "ending of a plugin's sink, such as .lerobot or .rosbag.",
        ),
    ],
    profile: Annotated[
        str | None, typer.Option(help="The sensor's profile. Default: the one in the recording.")
    ] = None,
    sink: Annotated[
        str | None, typer.Option(help="The sink that writes. Default: by the ending of OUT.")
    ] = None,
    readings: Annotated[
        bool, typer.Option("--readings", help="Measure, and write the quantities, too.")
    ] = False,
    bundle: Annotated[
        Path | None, typer.Option(help="With --readings: the calibration bundle.")
    ] = None,
    reference: Annotated[
        str | None,
        typer.Option(help="With --readings: the sensor with no contact, a path or 'first'."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a recording in another kind, completely or not at all; the recording stays."""
    from tactile_core.cli.output import Bar
    from tactile_core.pipeline.conversion import convert as convert_recording

    with Bar() as bar:
        done = convert_recording(
            source,
            out,
            profile=profile,
            sink=sink,
            readings=readings,
            bundle=bundle,
            reference=reference,
            progress=bar,
        )
    for note in done.notes:
        print_message(f"note: {note}")
    if as_json:
        print_json({"out": str(done.path), "kind": done.kind, "written": done.written})
    else:
        things = "images" if done.kind == "recording" else "observations"
        print_data(f"{done.path}: {done.written} {things}")
