"""``tactile train-force``: train a network that estimates force from images."""

from __future__ import annotations

from pathlib import Path
from shlex import join
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson, ProfileName, ReferencePath
from tactile_core.cli.output import print_data, print_json


def train_force(
    profile: ProfileName,
    out: Annotated[
        Path, typer.Option(help="Folder for force.onnx, its manifest and its data sheet.")
    ],
    sim: Annotated[
        bool, typer.Option("--sim", help="Train on virtual units of the profile.")
    ] = False,
    input: Annotated[Path | None, typer.Option(help="Train on this recording.")] = None,
    forces: Annotated[
        Path | None,
        typer.Option(
            help="With --input: CSV of frame or file, fx_n,fy_n,fz_n,tz_nmm and perhaps sequence."
        ),
    ] = None,
    reference: ReferencePath = None,
    epochs: Annotated[int, typer.Option(min=1, help="Passes over the images.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same network.")] = 0,
    units: Annotated[
        int, typer.Option(min=1, help="With --sim: number of virtual units, 250 images each.")
    ] = 90,
    as_json: AsJson = False,
) -> None:
    """Train a network for networks.force_cnn and score it on what it has not seen.

    A recording is scored on held-out sequences, virtual units on
    other units and objects.
    """
    from tactile_core.cli.output import Bar, table_lines
    from tactile_core.errors import InputError
    from tactile_core.profiles.loader import load_profile
    from tactile_train.network_training import (
        Plan,
        train_on_recording,
        train_on_virtual_units,
    )

    if sim == (input is not None):
        raise InputError("give either --sim, or --input with --forces")
    if input is not None and forces is None:
        raise InputError("--input needs --forces, a CSV with the force of each frame")
    loaded = load_profile(profile, sim=sim)
    shown = ["tactile", "train-force", profile, "--epochs", str(epochs)]
    shown += ["--seed", str(seed)]
    if input is not None and forces is not None:
        shown += ["--input", input.name, "--forces", forces.name, "--out", out.name]
    else:
        shown += ["--sim", "--units", str(units), "--out", out.name]
    command = join(shown)
    plan = Plan(out, epochs, seed, command)
    with Bar() as progress:
        if input is not None and forces is not None:
            trained = train_on_recording(
                loaded, plan, input=input, forces=forces, reference=reference, progress=progress
            )
        else:
            trained = train_on_virtual_units(loaded, plan, units=units, progress=progress)
    if as_json:
        print_json(trained.summary())
        return
    for heading, scores in trained.scores:
        print_data(heading)
        rows = [[one.of, str(one.samples), *(f"{value:.3f}" for value in one.r2)] for one in scores]
        for line in table_lines(["", "samples", "R² Fx", "Fy", "Fz", "Tz"], rows):
            print_data(line)
    print_data(f"{trained.manifest}: use it with 'force: {{use: networks.force_cnn, manifest: …}}'")
