"""``tactile export``: a calibration of ours in the format of another program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from tactile_core.cli.options import AsJson
from tactile_core.cli.output import print_data, print_json


def export(
    bundle: Annotated[Path, typer.Argument(metavar="BUNDLE", help="A calibration bundle.")],
    kind: Annotated[
        Literal["taxim", "taxim_rgb"],
        typer.Option("--as", help="For Taxim, or with red first, for Isaac Lab."),
    ],
    out: Annotated[Path, typer.Option(help="The file to write, polycalib.npz.")],
    as_json: AsJson = False,
) -> None:
    """Write a calibration for a simulator, which then renders this unit.

    The table says which change of colour each slope causes, as far as
    the calibration reaches.
    """
    from tactile_core.bundles.bundle import Bundle
    from tactile_imports.polynomial_table import write_table
    from tactile_imports.table_of_bundle import table_of

    table = table_of(Bundle.load(bundle))
    write_table(out, table, "bgr" if kind == "taxim" else "rgb")
    if as_json:
        print_json({"file": str(out), "kind": kind, "bins": table.bins})
    else:
        print_data(f"{out}: {table.bins} tilts × {table.bins} directions, as {kind}")
