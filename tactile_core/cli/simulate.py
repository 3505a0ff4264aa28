"""``tactile simulate``: frames of a virtual sensor with the ground truth of each frame."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson, ProfileName
from tactile_core.cli.output import print_data, print_json


def simulate(
    profile: ProfileName,
    script: Annotated[Path, typer.Option(help="YAML of the indenter and its motion.")],
    out: Annotated[Path, typer.Option(help="Folder for frames, reference and ground truth.")],
    seed: Annotated[
        int, typer.Option(min=0, help="Random seed of the unit's variations and its noise.")
    ] = 0,
    unit: Annotated[
        int | None,
        typer.Option(min=0, help="Another unit of the design, by its number. Default: the design."),
    ] = None,
    mode: Annotated[str, typer.Option(help="accurate, or fast for real time.")] = "accurate",
    as_json: AsJson = False,
) -> None:
    """Write the frames of a virtual sensor for a script, with the ground truth.

    Measure them with 'tactile run PROFILE --input OUT/frames --reference OUT/reference' and score
    the result with 'tactile compare … --truth OUT/truth'.
    """
    from tactile_core.cli.output import Bar
    from tactile_core.errors import InputError
    from tactile_core.profiles.loader import load_profile
    from tactile_core.sim.script import Script
    from tactile_core.sim.simulation import simulate as play
    from tactile_core.sim.stage import VirtualStage, vary

    if mode not in ("accurate", "fast"):
        raise InputError(f"--mode is 'accurate' or 'fast', not {mode!r}")
    steps = Script(script)
    design = load_profile(profile, sim=True)
    sensor = design if unit is None else vary(design, unit)
    stage = VirtualStage(sensor, seed, "fast" if mode == "fast" else "accurate")
    with Bar() as progress:
        count = play(stage, steps, out, progress=progress)
    if as_json:
        print_json({"out": str(out), "frames": count, "profile": stage.profile.name})
        return
    print_data(f"{out}: {count} frames of {stage.profile.name}, each with its ground truth")
