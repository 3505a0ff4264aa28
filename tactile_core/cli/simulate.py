"""``tactile simulate``: frames of a virtual rig with the truth beside each."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.output import say, say_json


def simulate(
    profile: Annotated[str, typer.Argument(help="A profile's name or the path of its YAML file.")],
    script: Annotated[Path, typer.Option(help="YAML of what is pressed and how it moves.")],
    out: Annotated[Path, typer.Option(help="Folder for frames, reference and truth.")],
    seed: Annotated[int, typer.Option(min=0, help="Makes the unit and its noise.")] = 0,
    mode: Annotated[str, typer.Option(help="accurate, or fast, which keeps up.")] = "accurate",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write what a profile's virtual twin sees of a script, and what is true.

    'tactile run PROFILE --input OUT/frames --reference OUT/reference' measures it, and
    'tactile compare … --truth OUT/truth' scores it.
    """
    from tactile_core.cli.progress import Bar
    from tactile_core.errors import InputError
    from tactile_core.sim.script import Script
    from tactile_core.sim.simulation import simulate as play
    from tactile_core.sim.stage import VirtualStage

    if mode not in ("accurate", "fast"):
        raise InputError(f"--mode is 'accurate' or 'fast', not {mode!r}")
    steps = Script(script)
    stage = VirtualStage(profile, seed, "fast" if mode == "fast" else "accurate")
    with Bar() as progress:
        count = play(stage, steps, out, progress=progress)
    if as_json:
        say_json({"out": str(out), "frames": count, "profile": stage.profile.name})
        return
    say(f"{out}: {count} frames of {stage.profile.name}, with the truth of each")
