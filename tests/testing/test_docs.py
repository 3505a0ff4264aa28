"""docs/how-to/test-a-plugin.md lists every check with the first line of its docstring."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

from tactile_core.testing import PluginConformance
from tactile_core.testing.checks import checks_of

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "how-to" / "test-a-plugin.md").read_text(encoding="utf-8")


def test_the_table_lists_exactly_the_checks() -> None:
    rows = dict(re.findall(r"^\| [^|]+ \| `(\w+)` \| (.+) \|$", PAGE, re.MULTILINE))
    assert rows == {
        name: (inspect.getdoc(check) or "").splitlines()[0]
        for name, check in checks_of(PluginConformance).items()
    }


def test_the_first_code_block_of_the_page_is_a_short_test_class() -> None:
    lines = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0]
    suite = ast.parse(lines).body[-1]
    assert isinstance(suite, ast.ClassDef)
    assert len(lines.strip().splitlines()) <= 7
