"""Every number that decides a result has a comment: its unit, its meaning and where it is from."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import reduce
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("tactile_core/algorithms", "tactile_core/calibration", "plugins/tactile-sim/tactile_sim")
MODULES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
GROUPS = sorted(
    path
    for folder in ("tactile_core", "plugins")
    for path in (ROOT / folder).rglob("*.py")
    if re.search(r"^class [A-Z_]+:", path.read_text("utf-8"), re.MULTILINE)
)


def _is_number(value: ast.expr) -> bool:
    """Whether an expression consists of literal numbers alone."""
    match value:
        case ast.Constant():
            return isinstance(value.value, int | float) and not isinstance(value.value, bool)
        case ast.UnaryOp():
            return _is_number(value.operand)
        case ast.BinOp():
            return _is_number(value.left) and _is_number(value.right)
        case ast.Tuple() | ast.List():
            return bool(value.elts) and all(map(_is_number, value.elts))
    return False


def _comments(text: str) -> dict[int, str]:
    """Comments by their lines."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return {token.start[0]: token.string for token in tokens if token.type == tokenize.COMMENT}


def _numbers(body: list[ast.stmt], text: str) -> Iterator[tuple[str, str]]:
    """Yield each number's name and comment: beside it, above it, or above the one before it."""
    comments, lines = _comments(text), text.split("\n")
    before, end = "", -1
    for statement in body:
        if not isinstance(statement, ast.Assign | ast.AnnAssign) or statement.value is None:
            continue
        first, last = statement.lineno, statement.end_lineno or statement.lineno
        said = " ".join(comments[line] for line in range(first, last + 1) if line in comments)
        above = first - 1
        while above in comments and lines[above - 1].lstrip().startswith("#"):
            said, above = f"{comments[above]} {said}", above - 1
        said = said or (before if end + 1 == first else "")
        before, end = said, last
        if _is_number(statement.value):
            target = statement.targets[0] if isinstance(statement, ast.Assign) else statement.target
            yield ast.unparse(target), said


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_each_number_of_a_module_has_a_comment(path: Path) -> None:
    text = path.read_text("utf-8")
    assert [name for name, said in _numbers(ast.parse(text).body, text) if not said] == []


@pytest.mark.parametrize("path", GROUPS, ids=lambda path: str(path.relative_to(ROOT)))
def test_each_number_of_a_group_has_a_unit_and_a_meaning(path: Path) -> None:
    text = path.read_text("utf-8")
    for node in ast.parse(text).body:
        if not isinstance(node, ast.ClassDef) or not node.name.isupper():
            continue
        assert not node.bases, f"{node.name} is a plain group of constants"
        for name, said in _numbers(node.body, text):
            assert re.search(r"# \[.+?\] \S", said), f"{node.name}.{name}: {said!r}"


def test_a_number_without_a_comment_is_found() -> None:
    text = "# [mm] Depth\nDEEP = 2.0\nDEEPER = 3.0\n\nBARE = 4\nSIDE = 5  # count\n"
    found = dict(_numbers(ast.parse(text).body, text))
    assert [name for name, said in found.items() if not said] == ["BARE"]


PAGE = (ROOT / "docs" / "reference" / "parameters.md").read_text("utf-8")


@pytest.mark.parametrize(
    ("module", "name", "value"),
    re.findall(r"^\| `([\w.]+)` \| `([\w.]+)` \| ([\d.]+) \|", PAGE, re.M),
)
def test_the_page_of_parameters_states_the_numbers_of_the_code(
    module: str, name: str, value: str
) -> None:
    held = reduce(getattr, name.split("."), import_module(f"tactile_core.{module}"))
    assert held == float(value)
