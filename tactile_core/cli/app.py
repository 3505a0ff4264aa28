"""Registers all commands without importing their dependencies."""

from __future__ import annotations

from typing import Annotated

import typer

from tactile_core.cli.bench import bench
from tactile_core.cli.calibrate import calibrate, calibrate_force
from tactile_core.cli.compare import compare
from tactile_core.cli.convert import convert
from tactile_core.cli.demo import demo
from tactile_core.cli.devices import devices
from tactile_core.cli.doctor import doctor
from tactile_core.cli.explaining import guard_command
from tactile_core.cli.new import new
from tactile_core.cli.profiles import plugins, profiles, schema, validate
from tactile_core.cli.record import record, recover
from tactile_core.cli.run import run
from tactile_core.cli.simulate import simulate
from tactile_core.cli.train_force import train_force
from tactile_core.cli.view import view

app = typer.Typer(
    name="tactile",
    help="Measure with optical tactile sensors of the GelSight family.",
    no_args_is_help=True,
    add_completion=False,
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
    demo,
    run,
    record,
    recover,
    convert,
    view,
    calibrate,
    calibrate_force,
    new,
    simulate,
    train_force,
    compare,
    bench,
    profiles,
    plugins,
    validate,
    schema,
    doctor,
    devices,
)
for command in COMMANDS:
    app.command()(guard_command(command))
