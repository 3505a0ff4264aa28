"""``tactile compare``: estimators or calibrations side by side, against the truth."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson, BundlePath, ProfileName, ReferencePath, Serial
from tactile_core.cli.output import print_data, print_json, print_message


def compare(
    profile: ProfileName,
    input: Annotated[
        Path | None,
        typer.Option(help="The recording: an image, a folder of images, a video or a scan."),
    ] = None,
    truth: Annotated[
        Path | None,
        typer.Option(
            help="Folder with one NAME.npz per frame, as 'tactile simulate' writes them. Arrays "
            "are compared with the arrays of the same name in the results of 'tactile run'."
        ),
    ] = None,
    presses: Annotated[
        Path | None,
        typer.Option(
            help="Instead of --input and --truth: a recording of presses of a ball, against which "
            "calibrations are scored."
        ),
    ] = None,
    ball_diameter_mm: Annotated[
        float | None,
        typer.Option(help="Diameter in mm of every ball that no catalog.csv in --presses lists."),
    ] = None,
    swap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STEP=USE",
            help="One variant: the profile with another estimator in this step "
            "(height=core.robust_poisson, or with options 'force={use: networks.force_cnn, "
            "manifest: net.yaml}'), or with another bundle (calibration=FOLDER). Repeat it for "
            "more variants; each changes the original profile.",
        ),
    ] = None,
    bundle: BundlePath = None,
    reference: ReferencePath = None,
    serial: Serial = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report.html, with pictures of one frame.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare estimators or calibrations on one recording: accuracy, time, memory.

    The first row is the unchanged profile. Accuracy counts every pixel of every frame; on presses
    of a ball, those well inside the contacts. Time is per frame on one core. Memory is the peak of
    a process that only measures the recording.
    """
    from tactile_core.cli.output import Bar, table_lines
    from tactile_core.errors import InputError
    from tactile_core.evaluation.comparison import compare as measure_all
    from tactile_core.evaluation.comparison import parse_swap
    from tactile_core.evaluation.comparison.ball_presses import compare_on_presses
    from tactile_core.evaluation.comparison.report import comparison_page, comparison_table
    from tactile_core.formats.files import write_atomically
    from tactile_core.pipeline.initial_reference import reference_path
    from tactile_core.recordings.inputs import PROFILE, Inputs
    from tactile_core.recordings.output_folder import REPORT, OutputFolder

    swaps = [parse_swap(words) for words in swap or []]
    if presses is not None:
        if input is not None or truth is not None or out is not None:
            raise InputError(
                "--presses is scored against the ball, as a table; leave --input, --truth and "
                "--out out"
            )
        with Bar() as progress:
            on_ball = compare_on_presses(
                profile,
                presses=presses,
                ball_diameter_mm=ball_diameter_mm,
                swaps=swaps,
                bundle=bundle,
                reference=reference,
                serial=serial,
                progress=progress,
            )
        for note in on_ball.notes:
            print_message(f"note: {note}")
        if as_json:
            print_json(on_ball.summary())
            return
        for line in table_lines(*on_ball.table()):
            print_data(line)
        return
    if input is None or truth is None:
        raise InputError("give --input and --truth, or --presses and --ball-diameter-mm")
    given = {
        PROFILE: profile,
        "--input": input,
        "--truth": truth,
        "--bundle": bundle,
        "--reference": reference_path(reference),
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
