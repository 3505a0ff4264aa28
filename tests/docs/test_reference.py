"""The Python reference has what the source offers, with its docstrings."""

from __future__ import annotations

import reference_pages
import reference_source as source
from docstring_markdown import markdown

import tactile_core

PAGES = reference_pages.pages()


def parts(entry: source.Entry) -> list[source.Entry]:
    return [entry, *(part for member in entry.members for part in parts(member))]


def test_every_public_name_has_an_entry() -> None:
    headings = {line.lstrip("# ") for page in PAGES.values() for line in page.splitlines()}
    assert set(tactile_core.__all__) - {"__version__"} <= headings


def test_every_public_docstring_is_on_a_page() -> None:
    text = "\n".join(PAGES.values())
    public = [part for name in source.public_names() for part in parts(source.entry(name))]
    assert [each.name for each in public if markdown(each.docstring) not in text] == []


def test_every_module_of_the_algorithms_is_on_a_page() -> None:
    folder = source.ROOT / "tactile_core" / "algorithms"
    there = {
        path.relative_to(folder).with_suffix("").as_posix().replace("/", ".")
        for path in folder.rglob("*.py")
        if path.stem != "__init__"
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
