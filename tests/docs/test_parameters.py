"""Tuning constants are fields of documented parameter classes, each with its unit and source."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("algorithms", "calibration", "sim")
MODULES = sorted(path for room in ROOMS for path in (ROOT / "tactile_core" / room).rglob("*.py"))
CLASSES = sorted(
    path
    for folder in ("tactile_core", "plugins")
    for path in (ROOT / folder).rglob("*.py")
    if "Parameters(" in path.read_text("utf-8")
)

_ENTRY = re.compile(r"^(\w+(?:, \w+)*) : ([^\n]+)\n((?:    [^\n]*\n|\n)+)", re.MULTILINE)


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


def _bare_numbers(path: Path) -> Iterator[str]:
    """Yield module-level numbers without a docstring right after them."""
    body = ast.parse(path.read_text("utf-8")).body
    for statement, following in zip(body, [*body[1:], None], strict=True):
        if not isinstance(statement, ast.Assign | ast.AnnAssign) or statement.value is None:
            continue
        documented = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
        if _is_number(statement.value) and not documented:
            yield f"{path.relative_to(ROOT)}:{statement.lineno}: {ast.unparse(statement)}"


def _parameter_classes(path: Path) -> Iterator[ast.ClassDef]:
    for node in ast.parse(path.read_text("utf-8")).body:
        if isinstance(node, ast.ClassDef) and node.name.endswith("Parameters"):
            yield node


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_module_has_no_undocumented_numbers(path: Path) -> None:
    assert not list(_bare_numbers(path))


@pytest.mark.parametrize("path", CLASSES, ids=lambda path: str(path.relative_to(ROOT)))
def test_each_parameter_has_unit_meaning_and_source(path: Path) -> None:
    for node in _parameter_classes(path):
        documentation = ast.get_docstring(node) or ""
        entries = {
            name: (kind, meaning)
            for names, kind, meaning in _ENTRY.findall(documentation + "\n")
            for name in names.split(", ")
        }
        fields = [
            line.target.id
            for line in node.body
            if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name)
        ]
        assert fields, f"{node.name} has no field"
        assert sorted(entries) == sorted(fields), node.name
        for name, (kind, meaning) in entries.items():
            is_number = re.match(r"int|float|tuple|\(", kind)
            assert ", " in kind or not is_number, f"{node.name}.{name} : {kind!r} lacks a unit"
            assert re.search(r"Source:\s+\S", meaning), f"{node.name}.{name} names no source"
            assert meaning.split("Source:")[0].strip(), f"{node.name}.{name} has no meaning"
        assert [ast.unparse(base) for base in node.bases] == ["NamedTuple"], node.name
