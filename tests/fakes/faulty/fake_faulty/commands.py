"""Commands that each do one thing wrong."""

from __future__ import annotations

from typing import Annotated

import typer

from tactile_core.cli.output import print_data


def greet(name: str, loud: Annotated[bool, typer.Option("--loud")] = False) -> None:
    """Do nothing wrong: greet somebody."""
    print_data(name.upper() if loud else name)


def undocumented(name: str) -> None:
    print_data(name)


def bare(name, loud=False) -> None:  # type: ignore[no-untyped-def]
    """Say nothing about its parameters."""
    print_data(name)


def starred(*names: str) -> None:
    """Take arguments without names."""
    print_data(" ".join(names))


async def asynchronous(name: str) -> None:
    """Wait for nobody."""
    print_data(name)


def untyped(phase: int | str) -> None:
    """Take one of two types."""
    print_data(str(phase))
