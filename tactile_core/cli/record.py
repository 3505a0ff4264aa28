"""``tactile record``, ``recover`` and ``convert``: recordings, made, rescued and copied."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import (
    AsJson,
    BundlePath,
    GelName,
    MostFrames,
    ProfileName,
    ReconnectS,
    ReferencePath,
    Script,
    Serial,
    Simulated,
    TimeoutS,
)
from tactile_core.cli.output import print_data, print_if_fewer, print_json, print_message


def record(
    profile: ProfileName,
    out: Annotated[Path, typer.Option(help="A new .mcap file, or a new folder for single images.")],
    serial: Serial = None,
    gel: GelName = None,
    sim: Simulated = False,
    script: Script = None,
    input: Annotated[
        Path | None, typer.Option(help="An image, a folder of images, a video or a scan.")
    ] = None,
    reference: ReferencePath = None,
    bundle: BundlePath = None,
    seconds: Annotated[
        float | None, typer.Option(help="Stop after this time. Default: with Ctrl-C.")
    ] = None,
    frames: MostFrames = None,
    readings: Annotated[
        bool, typer.Option("--readings", help="Measure, and record the quantities, too.")
    ] = False,
    timeout: TimeoutS = 1.0,
    reconnect_s: ReconnectS = 0.0,
    as_json: AsJson = False,
) -> None:
    """Record what the camera sends, exactly, with profile, bundle and reference inside."""
    from time import monotonic

    from tactile_core.cli.output import Bar
    from tactile_core.cli.signals import interrupt_ends
    from tactile_core.errors import InputError
    from tactile_core.pipeline.conversion import keep_recording
    from tactile_core.pipeline.opening import open_sensor

    if seconds is not None and not 0 < seconds < float("inf"):
        raise InputError(f"--seconds {seconds:g}? give a positive number")
    if input is not None and sim:
        raise InputError("--input and --sim exclude each other; give one of them")
    with open_sensor(
        profile,
        serial=serial,
        gel=gel,
        bundle=bundle,
        input=input,
        reference=reference,
        sim=sim,
        script=script,
        timeout_s=timeout,
        reconnect_s=reconnect_s,
    ) as sensor:
        for note in sensor.notes if readings else sensor.damage:
            print_message(f"note: {note}")
        began_s, interrupted = monotonic(), True
        with sensor.record(out, readings) as recording, Bar() as bar, interrupt_ends():
            bar.stage("recording", 1.0)
            steps = keep_recording(
                sensor, recording, seconds=seconds, frames=frames, timeout_s=timeout
            )
            for share in steps:
                bar.fraction(share)
            interrupted = False
    took_s = monotonic() - began_s
    if recording.failure is not None:
        raise OSError(recording.failure)
    if not recording.images + recording.dropped:
        raise InputError(f"{out}: nothing was recorded, because it ended before the first image")
    if left_out := recording.left_out():
        print_message(f"note: {left_out}")
    if not interrupted and (seconds is None or took_s < seconds):
        print_if_fewer(recording.images + recording.dropped, frames, seconds)
    counts = {"images": recording.images, "dropped": recording.dropped, "bytes": recording.bytes}
    if as_json:
        print_json({"out": str(out), **counts, "seconds": round(took_s, 3)})
        return
    print_data(f"{out}: {recording.images} images, {recording.bytes / 1e6:.1f} MB, {took_s:.1f} s")


def recover(
    file: Annotated[Path, typer.Argument(help="An interrupted or damaged .mcap recording.")],
    out: Annotated[
        Path | None,
        typer.Option(help="The new file. Default: beside it, as NAME.recovered.mcap."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write every sound frame of an interrupted or damaged recording to a new file."""
    from tactile_core.recordings.recovery import recover as recovered

    found = recovered(file, out)
    if found.damage:
        print_message(f"note: {found.damage}")
    if as_json:
        print_json({"out": str(found.path), "images": found.images, "messages": found.messages})
        return
    print_data(f"{found.path}: {found.images} images")


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
