"""``tactile calibrate-surface``: distance and angle of a surface, from labelled presses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson, ProfileName, ReferencePath, Serial
from tactile_core.cli.output import print_data, print_json, print_message


def calibrate_surface(
    profile: ProfileName,
    input: Annotated[
        Path, typer.Option(help="Recording of presses on a flat surface, one frame for each.")
    ],
    labels: Annotated[
        Path, typer.Option(help="CSV with the distance in mm and the angle in degrees of each.")
    ],
    out: Annotated[Path, typer.Option(help="Folder for the bundle.")],
    columns: Annotated[
        str, typer.Option(help="The columns of the CSV: file, distance, angle.")
    ] = "file,distance_mm,angle_deg",
    reference: ReferencePath = None,
    serial: Serial = None,
    as_json: AsJson = False,
) -> None:
    """Fit distance and angle of a surface to labelled presses, and score the fit on others."""
    from tactile_core.bundles.places import check_place, check_serial
    from tactile_core.cli.output import Bar, table_lines
    from tactile_core.pipeline.initial_reference import reference_path
    from tactile_core.recordings.inputs import PROFILE, Inputs
    from tactile_tactip.calibration import calibrate_surface as fit
    from tactile_tactip.labels import read_pose_labels

    if serial:
        check_serial(serial)
    given: dict[str, Path | str | None] = {
        PROFILE: profile,
        "--input": input,
        "--labels": labels,
        "--reference": reference_path(reference),
    }
    Inputs.from_paths(given).refuse_whole(out)
    check_place(out)
    known = read_pose_labels(labels, [name.strip() for name in columns.split(",")])
    with Bar() as progress:
        result = fit(profile, input, known, reference=reference, serial=serial, progress=progress)
    result.bundle.save(out)
    for note in result.notes:
        print_message(f"note: {note}")
    if as_json:
        print_json(result.summary(out))
        return
    print_data(f"{out}: distance and angle fitted to {result.presses} presses")
    for line in table_lines(*result.table()):
        print_data(line)
