"""``tactile import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson
from tactile_core.cli.output import print_data, print_json, print_message


def import_(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="The calibration that another program made.")
    ],
    kind: Annotated[str, typer.Option("--as", help="The importer that reads it, plugin.name.")],
    profile: Annotated[
        str, typer.Option(help="The sensor that it was made for: a profile's name or YAML file.")
    ],
    reference: Annotated[
        Path | None,
        typer.Option(help="Recording of the sensor with no contact, which the bundle keeps."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the bundle. Default: in the user's data directory."),
    ] = None,
    serial: Annotated[str, typer.Option(help="Serial of the physical unit.")] = "",
    gel: Annotated[str, typer.Option(help="Name of the gel on the unit.")] = "",
    as_json: AsJson = False,
) -> None:
    """Make a bundle of a calibration in another program's format."""
    from tactile_core.bundles.bundle import check_place, default_place
    from tactile_core.bundles.manifest import is_measured
    from tactile_core.calibration.imported import import_calibration
    from tactile_core.errors import InputError
    from tactile_core.profiles.loader import load_profile
    from tactile_core.recordings.inputs import PROFILE, Inputs

    loaded = load_profile(profile)
    folder = out if out is not None else default_place(loaded, serial or None, gel or None)
    inputs = Inputs.from_paths({"FILE": file, PROFILE: profile, "--reference": reference})
    inputs.refuse_whole(folder)
    if is_measured(check_place(folder)):
        raise InputError(
            f"{folder} holds a calibration that was made from presses; name another folder by "
            f"--out, or move that one away"
        )
    bundle = import_calibration(file, kind, loaded, reference=reference, serial=serial, gel=gel)
    bundle.save(folder)
    model = bundle.manifest.model
    if bundle.reference is None:
        print_message(
            "note: the bundle holds no reference; give --reference to each command that uses it"
        )
    if as_json:
        imported = {"kind": kind, "file": file.name}
        print_json({"bundle": str(folder), "model": model, "imported": imported, "held_out": None})
        return
    print_data(f"{folder}: {model}, imported from {file}; nothing is known of its errors")
