"""Numpydoc docstrings as Markdown."""

from __future__ import annotations

import inspect
import re

SECTIONS = (
    "Parameters",
    "Other Parameters",
    "Attributes",
    "Returns",
    "Yields",
    "Raises",
    "Warns",
    "See Also",
    "Notes",
    "Examples",
    "References",
)
"""Sections that numpydoc defines and this project uses."""

_LISTS = {"Parameters", "Other Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns"}
_RULED = re.compile(rf"^({'|'.join(SECTIONS)})\n-+\n", re.MULTILINE)
_ROLE = re.compile(r":[a-z]+:`~?(?:[^`]*\.)?([^`.]+)`")
_LITERAL = re.compile(r"``(.+?)``", re.DOTALL)
_CODE = re.compile(r"(`[^`]+`)")
_BLOCK = re.compile(r"^(.*?)::\n\n((?:[ ]+\S.*\n|\n)+)", re.MULTILINE)
_CITATION = re.compile(r"^\.\. \[(\w+)\] ", re.MULTILINE)


def markdown(docstring: str) -> str:
    """Convert a docstring.

    Parameters
    ----------
    docstring : str
        Numpydoc text without indentation.

    Returns
    -------
    str
        Markdown: the text, then one bold heading a section. Parameters, attributes, results and
        errors become lists.
    """
    before, *rest = _RULED.split(docstring + "\n")
    parts = [_text(before)]
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        convert = _entries if title in _LISTS else _references if title == "References" else _text
        parts.append(f"**{title}**\n\n{convert(body)}")
    return "\n\n".join(part for part in parts if part)


def summary(docstring: str) -> str:
    """Return the first sentence of a docstring on one line."""
    return " ".join(_text(docstring.split("\n\n")[0]).split())


def inline(text: str) -> str:
    """Convert roles and literals, and escape what Markdown would take for HTML."""
    text = _LITERAL.sub(lambda found: f"`{found[1]}`", _ROLE.sub(r"`\1`", text))
    text = re.sub(r"\[(\w+)\]_", r"[\1]", text)
    parts = _CODE.split(text)
    return "".join(p if i % 2 else re.sub(r"<(?=[\w/])", r"\\<", p) for i, p in enumerate(parts))


def _text(body: str) -> str:
    """Convert paragraphs, with their indented blocks of code."""
    parts = _BLOCK.split(body.strip() + "\n")
    done = [inline(parts[0])]
    for lead, code, after in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
        done.append(inline(lead + ":" if lead else ""))
        done.append(f"\n```python\n{inspect.cleandoc(code)}\n```\n")
        done.append(inline(after))
    return "\n".join(part for part in done if part).strip()


def _entries(body: str) -> str:
    """Convert ``name : type`` with indented descriptions to a list."""
    entries: list[tuple[str, list[str]]] = []
    for line in body.strip("\n").splitlines():
        if line and not line.startswith(" "):
            entries.append((line, []))
        elif entries:
            entries[-1][1].append(line)
    return "\n".join(_entry(head, inspect.cleandoc("\n".join(lines))) for head, lines in entries)


def _entry(head: str, description: str) -> str:
    name, colon, kind = head.partition(" : ")
    term = f"`{name}` : {inline(kind)}" if colon else f"`{name.replace('`', '')}`"
    if not description:
        return f"- {term}"
    paragraphs = _text(description).splitlines()
    return "\n".join([f"- {term}  ", *(f"  {line}" if line else "" for line in paragraphs)])


def _references(body: str) -> str:
    """Convert ``.. [1] …`` to a list."""
    text = re.sub(r"\n[ ]+", "\n  ", body.strip())
    return inline(_CITATION.sub(r"- [\1] ", text))
