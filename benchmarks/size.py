"""Size of the house, its tests aside: ``python benchmarks/size.py [FOLDER …]``.

Counted are lines, statements (every ``ast.stmt`` but docstrings), functions, and the lines of
docstrings and of comments per function, of the core, of the plugins and of both together.
"""

from __future__ import annotations

import argparse
import ast
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]


class Size(NamedTuple):
    """Counts of some modules."""

    modules: int = 0
    lines: int = 0
    statements: int = 0
    functions: int = 0
    docstrings: int = 0
    docstring_lines: int = 0
    comments: int = 0

    def __str__(self) -> str:
        per_function = [count / self.functions for count in self[-3:]]
        return (
            f"{self.modules:7,} {self.lines:8,} {self.statements:11,} {self.functions:10,} "
            + " ".join(f"{share:15.3f}" for share in per_function)
        )


HEADER = (
    "            modules    lines  statements  functions      docstrings docstring lines"
    "        comments (these three per function)"
)


def size_of(path: Path) -> Size:
    """Count one module."""
    text = path.read_text(encoding="utf-8")
    nodes = list(ast.walk(ast.parse(text)))
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = [
        node.body[0]
        for node in nodes
        if isinstance(node, documented) and ast.get_docstring(node, clean=False) is not None
    ]
    with path.open("rb") as file:
        comments = sum(token.type == tokenize.COMMENT for token in tokenize.tokenize(file.readline))
    return Size(
        1,
        len(text.splitlines()),
        sum(isinstance(node, ast.stmt) for node in nodes) - len(docstrings),
        sum(isinstance(node, documented[2:]) for node in nodes),
        len(docstrings),
        sum((one.end_lineno or one.lineno) - one.lineno + 1 for one in docstrings),
        comments,
    )


def modules(folder: Path) -> Iterator[Path]:
    """Yield the modules under a folder that are not tests."""
    for path in sorted(folder.rglob("*.py")):
        if "tests" not in path.relative_to(folder).parts:
            yield path


def total(sizes: list[Size]) -> Size:
    """Add counts up."""
    return Size(*map(sum, zip(*sizes, strict=True)))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", nargs="*", type=Path, metavar="FOLDER")
    folders = parser.parse_args().folders or [ROOT / "tactile_core", ROOT / "plugins"]
    found = {folder.name: total([size_of(path) for path in modules(folder)]) for folder in folders}
    print(HEADER)
    for name, size in found.items():
        print(f"{name:12}{size}")
    print(f"{'together':12}{total(list(found.values()))}")


if __name__ == "__main__":
    main()
