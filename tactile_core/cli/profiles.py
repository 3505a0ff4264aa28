"""``tactile profiles``, ``plugins``, ``validate`` and ``schema``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson
from tactile_core.cli.output import print_data, print_json, print_message


def profiles(as_json: AsJson = False) -> None:
    """List the available profiles."""
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
        print_json({"profiles": rows})
        return
    for entry in entries:
        print_data(f"{entry.name:<28}{entry.origin:<16}{_description(entry.path)}")


def _description(path: Path) -> str:
    """Return the description in a profile; "" if it cannot be read."""
    from tactile_core.errors import ProfileError
    from tactile_core.profiles.loader import load_source

    try:
        description = load_source(path).settings.get("description")
    except ProfileError:
        return ""
    return "" if description is None else " ".join(str(description.value).split())


def plugins(as_json: AsJson = False) -> None:
    """List the installed plugins and their components."""
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
        print_json({"plugins": rows})
        return
    for plugin in found:
        print_data(f"{plugin.name}  ({plugin.distribution} {plugin.version})")
        for kind, names in plugin.components.items():
            for name in sorted(names):
                print_data(f"    {kind:<14}{plugin.name}.{name}")
        for problem in plugin.problems:
            print_data(f"    problem: {problem}")


def validate(
    paths: Annotated[list[str], typer.Argument(metavar="PROFILE…", help="Names or YAML files.")],
) -> None:
    """Check profiles and report every mistake with its line."""
    from tactile_core.errors import TactileError
    from tactile_core.pipeline.parts import check_steps
    from tactile_core.profiles.loader import load_profile

    failed = False
    for path in paths:
        try:
            check_steps(load_profile(path))
        except TactileError as error:
            failed = True
            named = str(error) if path in str(error) else f"{path}: {error}"
            print_message(f"tactile: {named}")
        else:
            print_data(f"{path}: valid")
    if failed:
        raise typer.Exit(2)


def schema() -> None:
    """Print the JSON schema of profiles, for editors."""
    from tactile_core.profiles.model import profile_schema

    print_json(profile_schema(), indent=2)
