"""The commands of the core, without importing their dependencies, and those that plugins add."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from typer.core import TyperGroup
from typer.main import get_command

from tactile_core.cli.calibrate import calibrate, calibrate_force, import_
from tactile_core.cli.compare import compare
from tactile_core.cli.doctor import devices, doctor
from tactile_core.cli.explaining import guard_command
from tactile_core.cli.output import only_data_on_stdout, print_message
from tactile_core.cli.profiles import new, plugins, profiles, schema, validate
from tactile_core.cli.record import convert, record, recover
from tactile_core.cli.run import run
from tactile_core.errors import PluginError, words_of

if TYPE_CHECKING:
    from typer._click.core import Command, Context

    from tactile_core.plugins.plugin import Plugin

# Plugin of each command that other distributions of this project add.
ADDED_BY: Mapping[str, str] = {
    "bench": "sim",
    "calibrate-surface": "tactip",
    "demo": "sim",
    "export": "imports",
    "ros2": "ros2",
    "simulate": "sim",
    "train-force": "train",
    "view": "live",
}


class Commands(TyperGroup):
    """The core's commands first, then those that plugins add.

    Looking for a command imports plugins, whose prints go to stderr.
    """

    @cached_property
    def _adding(self) -> Mapping[str, Sequence[Plugin]]:
        """The plugins that add each command, which takes longer to find than all else of a call."""
        from tactile_core.plugins.registry import added_commands

        return added_commands()

    @only_data_on_stdout()
    def list_commands(self, ctx: Context) -> list[str]:
        """Return the names in the order of the help; note which commands cannot be used."""
        usable = super().list_commands(ctx)
        for name in sorted(self._adding):
            if name in usable:
                print_message(f"note: the command {name!r} of a plugin is hidden by the core's own")
                continue
            try:
                self._added_command(name)
            except PluginError as error:
                print_message(f"note: {error}")
            else:
                usable.append(name)
        return usable

    @only_data_on_stdout()
    def get_command(self, ctx: Context, cmd_name: str) -> Command | None:
        """Return a command by its name.

        Raises
        ------
        PluginError
            Its distribution is not installed, or broken.
        UsageError
            There is none of this name.
        """
        found = super().get_command(ctx, cmd_name) or self._added_command(cmd_name)
        if found is None:
            self._refuse(ctx, cmd_name)
        return found

    def _refuse(self, ctx: Context, cmd_name: str) -> NoReturn:
        from tactile_core.plugins.registry import find_plugin, list_plugins

        if cmd_name in ADDED_BY:
            find_plugin(ADDED_BY[cmd_name], f"the command {cmd_name!r}")  # raises, with the remedy
        near = get_close_matches(cmd_name, dict.fromkeys([*self.list_commands(ctx), *ADDED_BY]))
        meant = f" Did you mean {' or '.join(map(repr, near))}?" if near else ""
        broken = ", ".join(info.name for info in list_plugins() if info.status != "ok")
        if broken:
            meant += f" Not all of these plugins can be used: {broken}; see 'tactile doctor'."
        ctx.fail(f"No such command {cmd_name!r}.{meant}")

    def _added_command(self, name: str) -> Command | None:
        """Return a command that a plugin adds; None if no plugin does.

        Raises
        ------
        PluginError
            Two plugins add it, or it cannot be imported or called.
        """
        from tactile_core.plugins.registry import import_command

        if name not in self._adding:
            return None
        function = import_command(name, self._adding[name])
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command(name)(guard_command(function))
        try:
            return get_command(alone)
        except Exception as error:  # typer's, for parameters that it cannot understand
            raise PluginError(
                f"the command {name!r} of {function.__module__} has parameters that cannot be used "
                f"({words_of(error)}); repair or update its plugin"
            ) from error


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
