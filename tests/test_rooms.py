"""The package has few subpackages, and each documents its content and its allowed imports."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "tactile_core"
ROOMS = sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py"))


def test_there_are_at_most_twenty_subpackages_and_no_other_modules() -> None:
    assert len(ROOMS) <= 20
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py", "errors.py"}


@pytest.mark.parametrize("room", ROOMS)
def test_a_subpackage_documents_its_content_and_its_imports(room: str) -> None:
    text = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text())) or ""
    content, blank, may_import, *_ = text.splitlines()
    assert content.endswith(".")
    assert blank == ""
    assert may_import.startswith("May import ")


@pytest.mark.parametrize("room", ROOMS)
def test_the_tests_of_a_subpackage_are_in_a_folder_of_its_name(room: str) -> None:
    assert list((ROOT / "tests" / room).rglob("test_*.py"))


def test_no_test_imports_a_benchmark() -> None:
    benchmarks = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    for path in (ROOT / "tests").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            assert not benchmarks & {name.partition(".")[0] for name in names}, path
