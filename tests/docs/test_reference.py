"""The Python reference in the repository is that of the source."""

from __future__ import annotations

import reference_pages
import reference_source
from docstring_markdown import markdown

import tactile_core

PAGES = reference_pages.pages()


def test_the_committed_pages_are_up_to_date() -> None:
    committed = {path.name: path.read_text("utf-8") for path in reference_pages.FOLDER.glob("*.md")}
    stale = [name for name in PAGES | committed if PAGES.get(name) != committed.get(name)]
    assert not stale, f"run 'make reference' and commit {', '.join(stale)}"


def test_every_public_name_has_an_entry() -> None:
    headings = {line.lstrip("# ") for page in PAGES.values() for line in page.splitlines()}
    assert set(tactile_core.__all__) - {"__version__"} <= headings


def test_every_module_of_the_algorithms_is_on_a_page() -> None:
    folder = reference_source.ROOT / "tactile_core" / "algorithms"
    there = {
        path.relative_to(folder).with_suffix("").as_posix().replace("/", ".")
        for path in folder.rglob("*.py")
        if path.stem != "__init__" and "kernels" not in path.parts
    }
    text = "\n".join(PAGES.values())
    assert [name for name in sorted(there) if f"\n## {name}\n" not in text] == []


def test_a_page_can_be_read_in_one_sitting() -> None:
    assert [name for name, text in PAGES.items() if text.count("\n") > 1500] == []


def test_a_docstring_becomes_lists_and_bold_headings() -> None:
    docstring = (
        "Fit a line; see :func:`~numpy.polyfit` and ``x < y``.\n\n"
        "Parameters\n----------\n"
        "x, y : (N,) float, mm\n    Points [1]_.\n\n    At least two.\n\n"
        "Returns\n-------\nfloat\n    Slope.\n\n"
        "Raises\n------\nValueError\n\n"
        'References\n----------\n.. [1] A. Author,\n   "Title", 2015.'
    )
    assert markdown(docstring) == (
        "Fit a line; see `polyfit` and `x < y`.\n\n"
        "**Parameters**\n\n"
        "- `x, y` : (N,) float, mm  \n  Points [1].\n\n  At least two.\n\n"
        "**Returns**\n\n- `float`  \n  Slope.\n\n"
        "**Raises**\n\n- `ValueError`\n\n"
        '**References**\n\n- [1] A. Author,\n  "Title", 2015.'
    )
