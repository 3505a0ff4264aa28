"""The files behind the pages of the site, and the targets of their links."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable
from pathlib import Path

import reference_pages

ROOT = Path(__file__).resolve().parents[2]

ELSEWHERE = {
    "tutorials/first-plugin.md": "plugins/README.md",
    "how-to/contribute.md": "CONTRIBUTING.md",
    "reference/changelog.md": "CHANGELOG.md",
    "reference/rigs/hex-fingertip.md": "plugins/tactile-hex-fingertip/README.md",
    "reference/rigs/baxter-fingertip.md": "plugins/tactile-baxter-fingertip/README.md",
    "reference/rigs/gelsight-mini.md": "plugins/tactile-gelsight-mini/README.md",
    "reference/rigs/gelsight-wedge.md": "plugins/tactile-gelsight-wedge/README.md",
    "reference/rigs/gelslim.md": "plugins/tactile-gelslim/README.md",
    "reference/rigs/tactip.md": "plugins/tactile-tactip/README.md",
    "reference/rigs/digit.md": "plugins/tactile-digit/README.md",
    "reference/rigs/9dtact.md": "plugins/tactile-9dtact/README.md",
    "reference/rigs/desktop-six-led.md": "plugins/tactile-desktop-six-led/README.md",
}
"""Pages whose file is outside ``docs``."""

PYTHON = "reference/python/"
"""Pages in this folder are made of docstrings when the site is prepared."""

MADE = {
    "adr/index.md": "docs/adr",
    **{PYTHON + name: f"docs/{PYTHON}{name}" for name in reference_pages.pages()},
}
"""Pages that are generated when the site is prepared, and the path that links to them use."""

GENERATED = "images/generated/"
"""Pictures in this folder are drawn when the site is prepared."""

README_BEGINNING = "<!-- the beginning of README.md -->"
"""Placeholder in ``index.md`` for the part of README.md before its third heading."""

_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
_CODE = re.compile(r"(^```.*?^```$|`[^`\n]+`(?!\]))", re.MULTILINE | re.DOTALL)


def origin(page: str) -> str:
    """Return the repository path of a page's file."""
    return ELSEWHERE.get(page) or MADE.get(page) or f"docs/{page}"


def pages() -> dict[str, str]:
    """Return the pages of the site by their file in the repository."""
    own = {
        path.relative_to(ROOT).as_posix(): path.relative_to(ROOT / "docs").as_posix()
        for path in sorted((ROOT / "docs").rglob("*.md"))
    }
    return own | {file: page for page, file in (*ELSEWHERE.items(), *MADE.items())}


def text_of(page: str) -> str:
    """Return the Markdown of a page with its links translated for the site."""
    if page == "adr/index.md":
        return decisions()
    if page in MADE:
        return at_home(reference_pages.pages()[page.removeprefix(PYTHON)], page, origin(page))
    text = at_home((ROOT / origin(page)).read_text(encoding="utf-8"), page, origin(page))
    if README_BEGINNING in text:
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        beginning = "\n## ".join(readme.split("\n## ")[:2])
        text = text.replace(README_BEGINNING, at_home(beginning, page, "README.md").strip())
    return text


def at_home(text: str, page: str, file: str) -> str:
    """Translate the links of ``text`` from ``file`` in the repository to ``page`` of the site.

    Links to pages and to pictures in ``docs`` become links within the site. A link to any other
    file becomes the path of that file.
    """
    here, known = posixpath.dirname(page), pages()

    def rewritten(found: re.Match[str]) -> str:
        marker, words, link = found.groups()
        path, anchor = target(link, file)
        if path is None:
            return found[0]
        to = known.get(path) or (path.removeprefix("docs/") if path.startswith("docs/") else None)
        if to is None:
            return words if words.strip("`") == path else f"{words} (`{path}`)"
        return f"{marker}[{words}]({posixpath.relpath(to, here or '.')}{anchor})"

    return outside_code(text, lambda prose: _LINK.sub(rewritten, prose))


def links(text: str) -> list[str]:
    """Return the targets of the links and pictures of a text."""
    found: list[str] = []

    def noted(prose: str) -> str:
        found.extend(link for _, _, link in _LINK.findall(prose))
        return prose

    outside_code(text, noted)
    return found


def target(link: str, file: str) -> tuple[str | None, str]:
    """Return the path in the repository of a link in ``file``, and its anchor.

    The path is None for a link within the page or to another site.
    """
    path, marker, anchor = link.partition("#")
    if not path or ":" in path:
        return None, marker + anchor
    joined = posixpath.normpath(posixpath.join(posixpath.dirname(file), path))
    return joined, marker + anchor


def outside_code(text: str, change: Callable[[str], str]) -> str:
    """Apply ``change`` to everything except code."""
    parts = _CODE.split(text)
    return "".join(part if i % 2 else change(part) for i, part in enumerate(parts))


def decisions() -> str:
    """Return the page that lists the decisions."""
    lines = [
        "# Decisions",
        "",
        "Each page records a choice that could have been made otherwise, and the reasons. Figures "
        "are in [accuracy](../reference/accuracy.md) and "
        "[performance](../reference/performance.md).",
        "",
    ]
    for path in decision_files():
        title = path.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")
        lines.append(f"- [{title}]({path.name})")
    return "\n".join(lines) + "\n"


def decision_files() -> list[Path]:
    """Return the files of the decision records, in order."""
    return sorted((ROOT / "docs" / "adr").glob("[0-9]*.md"))
