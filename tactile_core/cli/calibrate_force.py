"""``tactile calibrate-force``: fit a force step to measured forces and add it to the bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import BundlePath, ReferencePath, Serial
from tactile_core.cli.output import print_data, print_json, print_message


def calibrate_force(
    profile: Annotated[str, typer.Argument(help="A profile's name or the path of its YAML file.")],
    input: Annotated[
        list[Path],
        typer.Option(
            help="A recording of presses whose force was measured; or several, in a folder or by "
            "several --input."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the bundle with the force model.")],
    forces: Annotated[
        list[Path] | None,
        typer.Option(
            help="CSV with frame, file or time_s, and fx_n,fy_n,fz_n,tz_nmm, of which some may be "
            "missing. One for each recording: several --forces, or a folder with NAME.csv."
        ),
    ] = None,
    weights: Annotated[
        Path | None,
        typer.Option(help="Instead of --forces: CSV file,mass_g of masses laid on the sensor."),
    ] = None,
    bundle: BundlePath = None,
    reference: ReferencePath = None,
    serial: Serial = None,
    step: Annotated[
        str | None, typer.Option(help="Step to fit. Default: the only one that can be fitted.")
    ] = None,
    align: Annotated[
        bool,
        typer.Option("--align", help="Turn the forces into the image's axes, as estimated."),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Fit the force step of a profile to measured forces, and score it on held-out sequences.

    A sequence is a recording or, if there is only one, a press between two rests. The bundle is a
    copy of the unit's with the force model added, or holds that model alone.
    """
    from tactile_core.bundles.bundle import check_place, check_serial
    from tactile_core.calibration.force.fitting import calibrate_force as fit
    from tactile_core.cli.output import Bar, table_lines
    from tactile_core.pipeline.initial_reference import FIRST
    from tactile_core.recordings.inputs import PROFILE, Inputs

    if serial:
        check_serial(serial)
    given: dict[str, Path | str | None] = {
        PROFILE: profile,
        "--reference": None if reference == FIRST else reference,
        "--weights": weights,
        **{f"--input {number}": path for number, path in enumerate(input, 1)},
        **{f"--forces {number}": path for number, path in enumerate(forces or (), 1)},
    }
    Inputs.from_paths(given).refuse_whole(out)
    check_place(out)
    with Bar() as progress:
        result = fit(
            profile,
            input,
            forces or (),
            weights=weights,
            bundle=bundle,
            reference=reference,
            serial=serial,
            step=step,
            align=align,
            progress=progress,
        )
    result.save(out)
    for note in result.notes:
        print_message(f"note: {note}")
    if as_json:
        print_json(result.summary(out))
        return
    print_data(
        f"{out}: step {result.step!r} fitted to {result.frames} frames in {result.sequences} "
        f"sequences"
    )
    for line in (*table_lines(*result.table()), *result.sentences()):
        print_data(line)
