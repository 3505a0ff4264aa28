"""``tactile evaluate`` and ``tactile compare``: results against a truth, and side by side."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from tactile_core.cli.options import BundlePath, ReferencePath, Serial, Simulated
from tactile_core.cli.output import print_data, print_json, print_message

# Summary for JSON; header and rows of the table.
Evaluated = tuple[dict[str, Any], tuple[list[str], list[list[str]]]]


def evaluate(
    figure: Annotated[
        Literal["floor", "normals"],
        typer.Argument(
            help="floor: the least force that is distinguished from none. normals: measured "
            "against true yaw and pitch on a pressed ball."
        ),
    ],
    profile: Annotated[str, typer.Argument(help="A profile's name or the path of its YAML file.")],
    sim: Simulated = False,
    seed: Annotated[
        int, typer.Option(min=0, help="With --sim: seed of the unit and of its noise.")
    ] = 0,
    input: Annotated[
        Path | None, typer.Option(help="A recording: with measured forces, or of a pressed ball.")
    ] = None,
    forces: Annotated[
        Path | None,
        typer.Option(help="floor: CSV of the recording: frame or file, then fx_n, fy_n, fz_n."),
    ] = None,
    ball_diameter_mm: Annotated[
        float | None, typer.Option(help="normals: diameter of the ball.")
    ] = None,
    bundle: BundlePath = None,
    reference: ReferencePath = None,
    serial: Serial = None,
    out: Annotated[
        Path | None, typer.Option(help="normals: folder for report.html, with the plots.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Evaluate a sensor like the literature does: its least force, or its normals on a ball.

    floor: noise at rest, slope near zero, and the smallest force from which on readings differ
    from rest by more than 99 % of the readings at rest do, for every step that gives a force.
    normals: errors of pitch and yaw, for each press and for all.
    """
    from tactile_core.cli.output import table_lines
    from tactile_core.errors import InputError

    if figure == "normals":
        if input is None or bundle is None or ball_diameter_mm is None or sim or forces:
            raise InputError(
                "normals needs --input, --bundle and --ball-diameter-mm, and takes neither --sim "
                "nor --forces"
            )
        summary, table = _normals(profile, input, bundle, ball_diameter_mm, reference, out)
    elif sim == (input is not None) or (input is None) != (forces is None) or out is not None:
        raise InputError("floor needs either --sim, or --input with --forces; it writes no report")
    else:
        summary, table = _floors(profile, seed, input, forces, bundle, reference, serial)
    if as_json:
        print_json({"figure": figure, **summary})
        return
    for line in table_lines(*table):
        print_data(line)


def _floors(
    profile: str,
    seed: int,
    input: Path | None,
    forces: Path | None,
    bundle: Path | None,
    reference: str | None,
    serial: str | None,
) -> Evaluated:
    from tactile_core.cli.output import Bar
    from tactile_core.evaluation.floor import floor_table, recorded_floors, virtual_floors

    with Bar() as progress:
        if input is not None and forces is not None:
            floors = recorded_floors(
                profile,
                input=input,
                forces=forces,
                bundle=bundle,
                reference=reference,
                serial=serial,
                progress=progress,
            )
        else:
            from tactile_core.bundles.bundle import Bundle
            from tactile_core.profiles.loader import load_profile

            floors = virtual_floors(
                load_profile(profile, sim=True),
                None if bundle is None else Bundle.load(bundle),
                seed=seed,
                progress=progress,
            )
    return {"floors": [floor.summary() for floor in floors]}, floor_table(floors)


def _normals(
    profile: str,
    input: Path,
    bundle: Path,
    ball_diameter_mm: float,
    reference: str | None,
    out: Path | None,
) -> Evaluated:
    from tactile_core.cli.output import Bar
    from tactile_core.evaluation.normals import evaluate_normals, normals_table
    from tactile_core.formats.files import write_atomically
    from tactile_core.recordings.inputs import PROFILE, Inputs
    from tactile_core.recordings.output_folder import REPORT, OutputFolder

    given: dict[str, Path | str | None] = {
        PROFILE: profile,
        "--input": input,
        "--bundle": bundle,
        "--reference": reference,
    }
    results = None if out is None else OutputFolder(out, Inputs.from_paths(given))
    if results is not None:
        results.check([REPORT])
    with Bar() as progress:
        found = evaluate_normals(
            profile,
            input=input,
            bundle=bundle,
            ball_diameter_mm=ball_diameter_mm,
            reference=None if reference is None else Path(reference),
            progress=progress,
        )
    for file, why in found.left_out:
        print_message(f"left out {file}: {why}")
    if results is not None:
        page = partial(write_atomically, data=found.page().encode())
        print_message(f"{results.write(REPORT, page)} shows the plots")
    return found.summary(), normals_table(found.rows)


def compare(
    profile: Annotated[str, typer.Argument(help="A profile's name or the path of its YAML file.")],
    input: Annotated[
        Path, typer.Option(help="The recording: an image, a folder of images, a video or a scan.")
    ],
    truth: Annotated[
        Path,
        typer.Option(
            help="Folder with one NAME.npz per frame, as 'tactile simulate' writes them. Arrays "
            "are compared with the arrays of the same name in the results of 'tactile run'."
        ),
    ],
    swap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STEP=USE",
            help="One variant: the profile with another estimator in this step "
            "(height=core.robust_poisson, or with options 'force={use: core.force_cnn, manifest: "
            "net.yaml}'), or with another bundle (calibration=FOLDER). Repeat it for more "
            "variants; each changes the original profile.",
        ),
    ] = None,
    bundle: BundlePath = None,
    reference: ReferencePath = None,
    serial: Serial = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report.html, with pictures of one frame.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Compare estimators or calibrations on one recording: accuracy, time, memory.

    The first row is the unchanged profile. Accuracy counts every pixel of every frame. Time is
    per frame on one core. Memory is the peak of a process that only measures the recording.
    """
    from tactile_core.cli.output import Bar, table_lines
    from tactile_core.evaluation.comparison import compare as measure_all
    from tactile_core.evaluation.comparison.report import comparison_page, comparison_table
    from tactile_core.evaluation.comparison.variants import parse_swap
    from tactile_core.formats.files import write_atomically
    from tactile_core.pipeline.initial_reference import FIRST
    from tactile_core.recordings.inputs import PROFILE, Inputs
    from tactile_core.recordings.output_folder import REPORT, OutputFolder

    swaps = [parse_swap(words) for words in swap or []]
    given = {
        PROFILE: profile,
        "--input": input,
        "--truth": truth,
        "--bundle": bundle,
        "--reference": None if reference == FIRST else reference,
        **{f"--swap {step}": use for step, use in swaps if not use.startswith("{")},
    }
    results = None if out is None else OutputFolder(out, Inputs.from_paths(given))
    if results is not None:
        results.check([REPORT])
    with Bar() as progress:
        result = measure_all(
            profile,
            input=input,
            truth=truth,
            swaps=swaps,
            bundle=bundle,
            reference=reference,
            serial=serial,
            progress=progress,
        )
    for variant in result.variants:
        for note in variant.notes:
            print_message(f"note: {variant.name}: {note}")
    if results is not None:
        report = results.write(
            REPORT, partial(write_atomically, data=comparison_page(result).encode())
        )
        print_message(f"{report} shows the pictures")
    if as_json:
        print_json(result.summary())
        return
    for line in table_lines(*comparison_table(result)):
        print_data(line)
