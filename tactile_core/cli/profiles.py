"""``tactile profiles``, ``new``, ``plugins``, ``validate`` and ``schema``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson
from tactile_core.cli.output import ask, print_data, print_json, print_message


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
    name_width = max(len(entry.name) for entry in entries)
    origin_width = max(len(entry.origin) for entry in entries)
    for entry in entries:
        columns = f"{entry.name:<{name_width}}  {entry.origin:<{origin_width}}"
        print_data(f"{columns}  {_description(entry.path)}".rstrip())


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
                "commands": sorted(p.commands),
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
        for name in sorted(plugin.commands):
            print_data(f"    {'command':<14}tactile {name}")
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
            if _has_simulator():
                load_profile(path, sim=True)  # its overlay, too
        except TactileError as error:
            failed = True
            named = str(error) if path in str(error) else f"{path}: {error}"
            print_message(f"tactile: {named}")
        else:
            print_data(f"{path}: valid")
    if failed:
        raise typer.Exit(2)


def _has_simulator() -> bool:
    """Whether the profile of a virtual sensor can be checked."""
    from tactile_core.errors import PluginError
    from tactile_core.interfaces.component import SIMULATOR
    from tactile_core.plugins.registry import find_plugin

    try:
        find_plugin(SIMULATOR.partition(".")[0])
    except PluginError:
        return False
    return True


def schema() -> None:
    """Print the JSON schema of profiles, for editors."""
    from tactile_core.profiles.model import profile_schema

    print_json(profile_schema(), indent=2)


def new(
    name: Annotated[str, typer.Argument(help="Name of the new profile: letters, digits and _.")],
    parent: Annotated[
        str, typer.Option("--from", help="The most similar profile: a name or a YAML file.")
    ],
    image: Annotated[
        Path,
        typer.Option(help="The sensor with no contact: an image, a folder, a video or a scan."),
    ],
    scale: Annotated[
        str | None,
        typer.Option(
            help="The scale: mm per px, or what measures it: grid:2, calliper:10, balls:6, "
            "markers:1.5, rectangle:24x32@x,y,… or the YAML of a ball grid; sizes in mm."
        ),
    ] = None,
    scale_image: Annotated[
        Path | None,
        typer.Option(help="The grid in front of the camera, or both balls or tips on the gel."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File, or folder with --plugin. Default: NAME.yaml; tactile-NAME with --plugin."
        ),
    ] = None,
    plugin: Annotated[
        bool,
        typer.Option("--plugin", help="Write a package with a first estimator and its test."),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
) -> None:
    """Write a commented minimal profile for your own sensor."""
    from tactile_core.scaffold import new_package, new_profile
    from tactile_core.scaffold.package import profile_path
    from tactile_core.scaffold.profile import refuse_existing

    default = f"tactile-{name.replace('_', '-')}" if plugin else f"{name}.yaml"
    place = out if out is not None else Path(default)
    refuse_existing(place, force=force, folder=plugin)
    profile = new_profile(
        name,
        parent,
        image,
        out=profile_path(place, name) if plugin else place,
        scale=scale,
        scale_image=scale_image,
        ask=ask if sys.stdin.isatty() else None,
    )
    made = new_package(profile) if plugin else profile
    made.write(place, force=force)
    for note in profile.notes:
        print_message(f"note: {note}")
    print_data(str(place))
    ball = "--ball-diameter-mm D"
    if scale is not None and scale.lower().endswith((".yaml", ".yml")):
        ball = f"--target {scale}"
    if plugin:
        steps = [f"pip install -e {place}", f"pytest {place}", f"tactile validate {name}"]
    else:
        steps = [
            f"tactile validate {place}",
            f"tactile calibrate {place} --presses FOLDER --reference {image} {ball} --out BUNDLE",
            f"tactile run {place} --bundle BUNDLE --input RECORDING --out RESULTS --save png,npz",
        ]
    for step in steps:
        print_message(f"next: {step}")
