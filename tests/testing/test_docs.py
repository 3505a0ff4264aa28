"""docs/how-to/test-a-plugin.md tells every check, in the words of its docstring."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

from tactile_core.testing import PluginConformance
from tactile_core.testing.checks import checks_of

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "how-to" / "test-a-plugin.md").read_text(encoding="utf-8")


def test_the_table_holds_every_check_and_no_other() -> None:
    told = dict(re.findall(r"^\| [^|]+ \| `(\w+)` \| (.+) \|$", PAGE, re.MULTILINE))
    assert told == {
        name: (inspect.getdoc(check) or "").splitlines()[0]
        for name, check in checks_of(PluginConformance).items()
    }


def test_the_first_lines_of_the_page_make_a_suite() -> None:
    lines = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0]
    suite = ast.parse(lines).body[-1]
    assert isinstance(suite, ast.ClassDef)
    assert len(lines.strip().splitlines()) <= 7
