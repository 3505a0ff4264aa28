"""``tactile profiles``, ``plugins``, ``validate``, ``schema`` and ``doctor``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.output import say, say_json, tell

AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def profiles(as_json: AsJson = False) -> None:
    """List the profiles that can be named."""
    from tactile_core.profiles.loader import list_profiles

    entries = list_profiles()
    if as_json:
        rows = [
            {
                "name": entry.name,
                "path": str(entry.path),
                "origin": entry.origin,
                "description": _description(entry.path),
            }
            for entry in entries
        ]
        say_json({"profiles": rows})
        return
    for entry in entries:
        say(f"{entry.name:<28}{entry.origin:<16}{_description(entry.path)}")


def _description(path: Path) -> str:
    """What a profile says of itself; "" where it cannot be read."""
    from tactile_core.errors import ProfileError
    from tactile_core.profiles.loader import load_source

    try:
        said = load_source(path).settings.get("description")
    except ProfileError:
        return ""
    return "" if said is None else " ".join(str(said.value).split())


def plugins(as_json: AsJson = False) -> None:
    """List the plugins and what each brings."""
    from tactile_core.plugins.registry import list_plugins

    found = list_plugins()
    if as_json:
        rows = [
            {
                "name": p.name,
                "distribution": p.distribution,
                "version": p.version,
                "components": {kind: sorted(names) for kind, names in p.components.items()},
                "problems": list(p.problems),
            }
            for p in found
        ]
        say_json({"plugins": rows})
        return
    for plugin in found:
        say(f"{plugin.name}  ({plugin.distribution} {plugin.version})")
        for kind, names in plugin.components.items():
            for name in sorted(names):
                say(f"    {kind:<14}{plugin.name}.{name}")
        for problem in plugin.problems:
            say(f"    problem: {problem}")


def validate(
    paths: Annotated[list[str], typer.Argument(metavar="PROFILE…", help="Names or YAML files.")],
) -> None:
    """Check profiles and report every mistake with its line."""
    from tactile_core.errors import TactileError
    from tactile_core.pipeline.profile_steps import check_steps
    from tactile_core.profiles.loader import load_profile

    failed = False
    for path in paths:
        try:
            check_steps(load_profile(path))
        except TactileError as error:
            failed = True
            tell(f"tactile: {error}")
        else:
            say(f"{path}: valid")
    if failed:
        raise typer.Exit(2)


def schema() -> None:
    """Print the JSON schema of profiles, for editors."""
    from tactile_core.profiles.schema import profile_schema

    say_json(profile_schema(), indent=2)


def doctor(
    profile: Annotated[str | None, typer.Argument(help="A profile to look at as well.")] = None,
    sim: Annotated[bool, typer.Option("--sim", help="Open its virtual twin, too.")] = False,
) -> None:
    """Say what is wrong with the plugins, and with a profile."""
    from tactile_core.errors import InputError
    from tactile_core.pipeline.profile_steps import check_steps
    from tactile_core.pipeline.sensor import open_sensor
    from tactile_core.plugins.registry import list_plugins
    from tactile_core.profiles.loader import load_profile

    if sim and profile is None:
        raise InputError("--sim opens the virtual twin of a profile; name one")
    sound = True
    for plugin in list_plugins(import_components=True):
        say(f"{'ok' if not plugin.problems else 'PROBLEM':<9}plugin {plugin.name}")
        for problem in plugin.problems:
            sound = False
            say(f"         {problem}")
    if profile is not None:
        check_steps(load_profile(profile))
        say(f"{'ok':<9}profile {profile}")
    if profile is not None and sim:
        with open_sensor(profile, sim=True) as sensor:
            height, width, channels = sensor.read().frame.pixels.shape
        say(f"{'ok':<9}twin of {profile}: {width} × {height}, {channels} channels")
    if not sound:
        raise typer.Exit(2)
