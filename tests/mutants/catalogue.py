"""The catalogue of mutants: the change of each, and the tests that must detect it."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[2]
LISTS = Path(__file__).parent / "lists"


class Mutant(BaseModel):
    """One mistake.

    Attributes
    ----------
    area : str
        Name of its list.
    id : str
    says : str
        Description of the mistake.
    file : str
        The changed file, relative to the root of the repository.
    old, new : str
        A snippet that occurs exactly once, and its replacement.
    tests : tuple of str
        Files or node ids of tests; at least one of them must fail.
    equivalent : str
        Reason why no test can detect it; empty for all others.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    area: str
    id: str = Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")
    says: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...] = Field(min_length=1)
    equivalent: str = ""

    def made_in(self, tree: Path) -> str:
        """Return the file's text with the mistake.

        Raises
        ------
        ValueError
            The snippet does not occur exactly once.
        """
        text = (tree / self.file).read_text(encoding="utf-8")
        count = text.count(self.old)
        if count != 1:
            raise ValueError(
                f"{self.area}/{self.id}: the snippet occurs {count} times in {self.file}"
            )
        return text.replace(self.old, self.new)


def read_lists(folder: Path = LISTS) -> list[Mutant]:
    """Read all lists, sorted by area."""
    mutants = []
    for path in sorted(folder.glob("*.yaml")):
        entries = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
        mutants += [Mutant.model_validate({"area": path.stem, **entry}) for entry in entries]
    return mutants


def chosen(mutants: Sequence[Mutant], only: Sequence[str]) -> list[Mutant]:
    """Return the mutants of the given areas or ids; all mutants if none is given.

    Raises
    ------
    ValueError
        A name is neither an area nor an id.
    """
    known = {name for mutant in mutants for name in (mutant.area, mutant.id)}
    unknown = sorted(set(only) - known)
    if unknown:
        raise ValueError(f"no area and no mutant is called {unknown[0]!r}")
    return [m for m in mutants if not only or {m.area, m.id} & set(only)]


def has_test(node: str, tree: Path = ROOT) -> bool:
    """Return whether a node's file exists and defines its function."""
    name, _, function = node.partition("::")
    path = tree / name
    if not function:
        return path.exists()
    if not path.is_file():
        return False
    wanted = function.partition("[")[0].split("::")[-1]
    parsed = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return any(isinstance(part, ast.FunctionDef) and part.name == wanted for part in parsed)
