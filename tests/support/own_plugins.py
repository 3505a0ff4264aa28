"""A plugin that is installed for one test."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Protocol

import pytest
from support.dist_info import write_dist_info

_MODULE = """\
from pathlib import Path
from tactile_core.interfaces.hookspecs import hookimpl

"""
_HOOK = """
@hookimpl
def {hook}():
    return {value}
"""
_PROJECT = """\
[project]
name = "tactile-{name}"
version = "1.0"

[project.entry-points."tactile_core.v1"]
{name} = "own_{name}"
"""


class Install(Protocol):
    """Installs a plugin."""

    def __call__(
        self, name: str, files: Mapping[str, str], **hooks: str | Mapping[str, str]
    ) -> Path:
        """Write the package ``own_{name}`` with its files; a hook's string names its folder."""


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    site = tmp_path / "site"

    def installed(name: str, files: Mapping[str, str], **hooks: str | Mapping[str, str]) -> Path:
        package = site / f"own_{name}"
        for file, text in files.items():
            path = package / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        module = _MODULE
        for hook, what in hooks.items():
            folder = f"Path(__file__).parent / {what!r}"
            module += _HOOK.format(hook=hook, value=folder if isinstance(what, str) else dict(what))
        (package / "__init__.py").write_text(module, encoding="utf-8")
        (site / "pyproject.toml").write_text(_PROJECT.format(name=name), encoding="utf-8")
        write_dist_info(site, site)
        return package

    site.mkdir()
    monkeypatch.syspath_prepend(site)
    yield installed
    for name in [name for name in sys.modules if name.startswith("own_")]:
        del sys.modules[name]
