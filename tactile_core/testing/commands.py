"""Checks of commands."""

from __future__ import annotations

from inspect import signature

import typer
from typer.main import get_command

from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import report, report_errors
from tactile_core.testing.registered import AddedCommand


class CommandChecks(Suite):
    """The contract of the hook ``tactile_commands``."""

    @check("command")
    def test_command(self, command: AddedCommand) -> None:
        """A command is a function with a docstring, and each parameter has an annotation."""
        why = "'tactile' cannot call it, or its help does not say what it takes"
        do = "see docs/tutorials/first-command.md: annotate each parameter as for typer"
        alone = typer.Typer()
        with report_errors(command, "it cannot be used", why=why, do=do):
            function = self.registered.function_of(command)
            given = signature(function).parameters.values()
            alone.command()(function)
            get_command(alone)
        bare = [one.name for one in given if one.annotation is one.empty]
        found = f"{', '.join(bare)}: no annotation" if bare else ""
        found = found or ("" if function.__doc__ else "it has no docstring, which is its help")
        report(command, found, why=why, do=do)
