"""The blocks of code of a page, and the commands in them."""

import re
import shlex
from importlib import import_module
from pathlib import Path
from typing import Any

import typer

from tactile_core.cli.app import ADDED_BY, app

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def blocks(language: str, page: str = README) -> list[str]:
    """Return all blocks of code in a language."""
    return re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)


def block(language: str) -> str:
    """Return the first block of code in a language."""
    return blocks(language)[0]


def commands(page: str = README) -> list[list[str]]:
    """Return the arguments of every command ``tactile …`` of a page."""
    lines = "\n".join(blocks("sh", page)).replace("\\\n", " ").splitlines()
    return [shlex.split(line)[1:] for line in lines if line.startswith("tactile ")]


def known_commands() -> dict[str, Any]:
    """Return every command of ``tactile``, also of distributions that are not installed here."""
    group = typer.main.get_command(app)
    found = dict(group.commands)  # type: ignore[attr-defined]
    for name, plugin in ADDED_BY.items():
        alone = typer.Typer(add_completion=False)
        module, function = _hooks(plugin).tactile_commands()[name].split(":")
        alone.command(name)(getattr(import_module(module), function))
        found[name] = typer.main.get_command(alone)
    return found


def _hooks(plugin: str) -> Any:
    text = (ROOT / "plugins" / f"tactile-{plugin}" / "pyproject.toml").read_text(encoding="utf-8")
    named = re.search(rf'^{plugin} = "(.+)"', text, re.MULTILINE)
    assert named is not None
    return import_module(named[1])
