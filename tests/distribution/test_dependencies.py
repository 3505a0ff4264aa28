"""What is declared is used: no user installs a package for nothing."""

from __future__ import annotations

import ast
import re
import tomllib
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

import tactile_core

PACKAGE = Path(tactile_core.__file__).parent
PROJECT = PACKAGE.parent / "pyproject.toml"


def declared() -> list[str]:
    """Names of the distributions that installing the package brings."""
    table = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    return sorted({re.split(r"[^A-Za-z0-9._-]", each)[0] for each in table["dependencies"]})


@cache
def imported() -> set[str]:
    """Names of the distributions whose packages some module imports."""
    modules = set[str]()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                modules.add(node.module.partition(".")[0])
    brings = packages_distributions()
    return {name for module in modules for name in brings.get(module, ())}


@pytest.mark.parametrize("name", declared())
def test_every_declared_dependency_is_imported(name: str) -> None:
    assert name in imported()
