"""``tactile run``: measures a sensor, a recording or many."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tactile_core.cli.options import (
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
from tactile_core.cli.output import (
    Bar,
    Warnings,
    print_data,
    print_if_fewer,
    print_json,
    print_message,
)

if TYPE_CHECKING:
    from tactile_core.interfaces.sink import Reading
    from tactile_core.pipeline.batch.recording_job import MeasuredRecording


def run(
    profile: ProfileName,
    serial: Serial = None,
    gel: GelName = None,
    sim: Simulated = False,
    script: Script = None,
    input: Annotated[
        list[Path] | None,
        typer.Option(
            help="An image, a folder of images, a video, a scan or a recording; or several, in a "
            "folder or by several --input."
        ),
    ] = None,
    reference: ReferencePath = None,
    bundle: BundlePath = None,
    tare_frame: Annotated[
        int | None, typer.Option(min=0, help="Sequence number of the frame with zero load.")
    ] = None,
    frames: MostFrames = None,
    timeout: TimeoutS = 1.0,
    reconnect_s: ReconnectS = 0.0,
    workers: Annotated[
        int, typer.Option(min=1, max=256, help="Number of processes that measure.")
    ] = 1,
    cluster: Annotated[
        str | None,
        typer.Option(help="Address of a dask scheduler whose workers measure the recordings."),
    ] = None,
    external: Annotated[
        Path | None,
        typer.Option(help="Folder with one NAME.npz of external quantities per frame."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results.")] = None,
    save: Annotated[
        str | None,
        typer.Option(
            help="Formats or sinks, separated by commas: npz, tmd, png, ply, record, a sink of the "
            "profile, or plugin.name. Default: npz with --out, else nothing."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object per line.")
    ] = False,
) -> None:
    """Measure height, contact and the results of all other steps of a profile."""
    from tactile_core.bundles.places import default_place
    from tactile_core.errors import InputError
    from tactile_core.pipeline.initial_reference import reference_path
    from tactile_core.pipeline.opening import open_sensor
    from tactile_core.pipeline.playback import observation_names
    from tactile_core.pipeline.sinks import Sinks
    from tactile_core.plugins.blame import blame_of
    from tactile_core.recordings.inputs import PROFILE, Inputs
    from tactile_core.recordings.output_folder import OutputFolder
    from tactile_core.recordings.recorded_source import SavedInputs

    if frames is not None and frames > sys.maxsize:
        raise InputError(f"--frames {frames} is too large; leave the option out to measure all")
    names = ["npz"] if save is None and out is not None else (save or "").split(",")
    names = [name for name in names if name]
    if save is not None and not names:
        raise InputError("--save names nothing to write; give it npz, tmd, png, ply or a sink")
    if input and sim:
        raise InputError("--input and --sim exclude each other; give one of them")
    if input and are_several(profile, input):
        unusable = {"--script": script, "--external": external}
        run_batch(
            profile,
            input,
            serial=serial,
            gel=gel,
            reference=reference,
            bundle=bundle,
            tare_frame=tare_frame,
            frames=frames,
            out=out,
            save=names,
            unusable=[option for option, value in unusable.items() if value is not None],
            workers=workers,
            cluster=cluster,
            as_json=as_json,
        )
        return
    if cluster is not None:
        raise InputError(
            "a cluster measures several recordings at once; give a folder of them, or several "
            "--input"
        )
    recording = input[0] if input else None
    given = {
        PROFILE: profile,
        "--input": recording,
        "--reference": reference_path(reference),
        "--bundle": bundle,
        "--script": script,
        "--external": external,
    }
    results = None if out is None else OutputFolder(out, Inputs.from_paths(given))
    with open_sensor(
        profile,
        serial=serial,
        gel=gel,
        bundle=bundle,
        input=recording,
        reference=reference,
        sim=sim,
        script=script,
        timeout_s=timeout,
        reconnect_s=reconnect_s,
    ) as sensor:
        sinks = Sinks(sensor.profile, names)
        sensor.keep_raw = sinks.keeps_raw
        if results is not None:
            if bundle is None:
                place = default_place(sensor.profile, serial, gel)
                Inputs.from_paths({"the bundle": place}).refuse_shared(results.path)
            if recording is not None:
                sources = observation_names(sensor.profile, recording)
                results.check_for(sources, sinks.endings)
        for note in (*sensor.notes, *unread_notes(recording)):
            print_message(f"note: {note}")
        warnings = Warnings(sensor.notes)
        tared = tare_frame is None
        inputs = None if external is None else SavedInputs(external, sensor.pipeline.takes)
        stream = sensor.stream(tare_frame=tare_frame, workers=workers, inputs=inputs)
        count = 0
        with sinks.open(sensor.pipeline, results, sensor.record):
            for count, reading in enumerate(islice(stream, frames), 1):  # noqa: B007
                tared |= reading.frame.sequence == tare_frame
                sinks.write(reading)
                line = reading.summary(blame_of)
                if as_json:
                    print_json(line)
                else:
                    warnings.print(reading.warnings)
                    print_data(_text(reading, line))
        print_if_fewer(count, frames)
    if not tared:
        raise InputError(
            f"--tare-frame {tare_frame}: no frame with this number was measured, so nothing was "
            f"subtracted; numbers start at 0"
        )


def _text(reading: Reading, line: dict[str, Any]) -> str:
    own = [*_own_texts(reading)]
    surface = line["max_height_mm"], line["contact_area_mm2"]
    parts = [
        *(() if own and surface == (None, None) else _contact_texts(*surface)),
        *_shear_texts(line),
        *own,
        f"{reading.latency_ms:.1f} ms",
    ]
    return f"{reading.source}: {', '.join(parts)}"


def _contact_texts(height_mm: float | None, area_mm2: float | None) -> list[str]:
    """Return the texts about height and contact area; only a contact has a depth."""
    if area_mm2:
        depth = "no height" if height_mm is None else f"{height_mm:.3f} mm deep"
        return [depth, f"{area_mm2:.2f} mm² in contact"]
    height = "no height" if height_mm is None else f"height up to {height_mm:.3f} mm"
    return [height, "no contact mask" if area_mm2 is None else "no contact"]


def _shear_texts(line: dict[str, Any]) -> list[str]:
    """Return the text about markers and slip, for the quantities that the chain measures."""
    parts = []
    markers, slip = line.get("markers"), line.get("slip")
    if markers is not None:
        parts.append(f"{markers['seen']} of {markers['expected']} markers seen")
    if slip is not None:
        words = slip["state"] if slip["state"] != "none" else "no contact"
        if slip["reason"]:
            words += f" ({slip['reason']})"
        if slip["kind"] is not None:
            words += f" ({slip['kind']}, degree {slip['degree']:.2f})"
        parts.append(words)
    return parts


def _own_texts(reading: Reading) -> Iterator[str]:
    """Yield what quantities say of themselves."""
    from tactile_core.plugins.blame import blame_of

    for quantity in reading.quantities.values():
        with blame_of(quantity):
            text = quantity.text()
        if text:
            yield text


def are_several(profile: str, inputs: Sequence[Path]) -> bool:
    """Whether ``--input`` gives several recordings: several paths, or a folder of recordings."""
    if len(inputs) > 1:
        return True
    if not inputs[0].is_dir():
        return False
    from tactile_core.acquisition.devices import images_per_observation
    from tactile_core.profiles.loader import load_profile
    from tactile_core.recordings.recovery import is_folder_of_recordings

    count = images_per_observation(load_profile(profile))
    return is_folder_of_recordings(inputs[0], images_per_observation=count)


def unread_notes(recording: Path | None) -> Iterator[str]:
    """Yield a note if a folder of images contains recordings, which are not measured."""
    from tactile_core.recordings.recovery import unread_recordings

    unread = [] if recording is None else unread_recordings(recording)
    if unread:
        yield (
            f"{recording} is read as a folder of images, so {unread[0].name} in it is not "
            f"measured; to measure recordings, move them to a folder of their own"
        )


def run_batch(
    profile: str,
    inputs: Sequence[Path],
    *,
    unusable: Sequence[str],
    workers: int,
    cluster: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Measure several recordings.

    Parameters
    ----------
    profile : str
    inputs : sequence of Path
    unusable : sequence of str
        Options on the command line that belong to a single recording.
    workers : int
    cluster : str or None
    as_json : bool
    **options
        Further arguments of :class:`~tactile_core.pipeline.batch.batch.Batch`.
    """
    from tactile_core.errors import InputError
    from tactile_core.pipeline.batch.batch import Batch

    if unusable:
        raise InputError(
            f"{' and '.join(unusable)} cannot hold for several recordings; measure one at a time"
        )
    batch = Batch(profile, inputs, **options)
    failed: list[MeasuredRecording] = []
    said: set[str] = set()
    with (
        Bar() as bar,
        closing(batch.measure(workers=workers, cluster=cluster, progress=bar)) as results,
    ):
        for found in results:
            if found.failure:
                failed.append(found)
                continue
            for note in found.notes:
                if note not in said:  # most hold for every recording
                    print_message(f"note: {note}")
                said.add(note)
            if as_json:
                for line in found.lines():
                    print_json(line)
            else:
                print_data(_job_text(found))
    if failed:
        count = f"{len(failed)} of {len(batch.jobs)} recordings"
        print_message(f"tactile: {count} could not be measured and are left out:")
        for sentence, names in _by_sentence(failed).items():
            print_message(f"  {', '.join(names)}: {sentence}")
        raise typer.Exit(1)


def _job_text(found: MeasuredRecording) -> str:
    count = "1 observation" if found.observations == 1 else f"{found.observations} observations"
    parts = [count]
    if found.deepest_mm is not None:
        parts.append(f"height up to {found.deepest_mm:.3f} mm")
    if found.warned:
        parts.append(f"{found.warned} with warnings")
    parts.append("measured before" if found.earlier else f"{found.duration_s:.1f} s")
    return f"{found.name}: {', '.join(parts)}"


def _by_sentence(failed: Sequence[MeasuredRecording]) -> dict[str, list[str]]:
    names: dict[str, list[str]] = {}
    for one in failed:
        names.setdefault(one.failure, []).append(one.name)
    return names
