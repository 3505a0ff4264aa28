"""The commands of the core, without importing their dependencies, and those that plugins add."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Annotated

import typer
from typer.core import TyperGroup
from typer.main import get_command

from tactile_core.cli.calibrate import calibrate, calibrate_force
from tactile_core.cli.compare import compare
from tactile_core.cli.doctor import devices, doctor
from tactile_core.cli.explaining import guard_command
from tactile_core.cli.importing import import_
from tactile_core.cli.profiles import new, plugins, profiles, schema, validate
from tactile_core.cli.record import convert, record, recover
from tactile_core.cli.run import run

if TYPE_CHECKING:
    from typer._click.core import Command, Context

# Plugin of each command that other distributions of this project add.
ADDED_BY: Mapping[str, str] = {
    "bench": "sim",
    "demo": "sim",
    "simulate": "sim",
    "train-force": "train",
    "view": "live",
}


class Commands(TyperGroup):
    """The core's commands first, then those that plugins add."""

    def list_commands(self, ctx: Context) -> list[str]:
        """Return the names in the order of the help."""
        from tactile_core.plugins.registry import added_commands

        own = super().list_commands(ctx)
        return [*own, *(name for name in added_commands() if name not in own)]

    def get_command(self, ctx: Context, cmd_name: str) -> Command | None:
        """Return a command by its name.

        Raises
        ------
        PluginError
            Its distribution is not installed, or broken.
        UsageError
            There is none of this name.
        """
        own = super().get_command(ctx, cmd_name)
        if own is not None:
            return own
        from tactile_core.plugins.registry import find_command, find_plugin

        plugin = ADDED_BY.get(cmd_name)
        if plugin is None:
            function = find_command(cmd_name)
        else:
            function = find_plugin(plugin, f"the command {cmd_name!r}").command(cmd_name)
        if function is None:
            near = get_close_matches(cmd_name, self.list_commands(ctx))
            meant = f" Did you mean {' or '.join(map(repr, near))}?" if near else ""
            ctx.fail(f"No such command {cmd_name!r}.{meant}")
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command(cmd_name)(guard_command(function))
        return get_command(alone)


app = typer.Typer(
    name="tactile",
    cls=Commands,
    help="Measure with optical tactile sensors of the GelSight family.",
    no_args_is_help=True,
    add_completion=False,
    suggest_commands=False,  # knows the core's alone
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def _options(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of errors.")] = False,
) -> None:
    # main() removes --debug from anywhere on the line; it is declared here only for --help.
    if version:
        from tactile_core import __version__

        typer.echo(__version__)
        raise typer.Exit


COMMANDS = (
    run,
    record,
    recover,
    convert,
    calibrate,
    calibrate_force,
    import_,
    new,
    compare,
    profiles,
    plugins,
    validate,
    schema,
    doctor,
    devices,
)
for command in COMMANDS:
    app.command(command.__name__.rstrip("_").replace("_", "-"))(guard_command(command))
