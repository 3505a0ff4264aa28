"""Mapping between files of the repository and pages of the site, and rewriting of links."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

ELSEWHERE = {
    "first-plugin.md": "plugins/README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
    "rigs/hex-fingertip.md": "plugins/tactile-hex-fingertip/README.md",
    "rigs/baxter-fingertip.md": "plugins/tactile-baxter-fingertip/README.md",
    "rigs/desktop-six-led.md": "plugins/tactile-desktop-six-led/README.md",
}
"""Pages whose file is outside ``docs``."""

MADE = {"adr/index.md": "docs/adr"}
"""Pages that are generated when the site is built, and the folder that they represent."""

GENERATED = "images/generated/"
"""Folder of pictures that are generated when the site is built."""

README_BEGINNING = "<!-- the beginning of README.md -->"
"""Placeholder in ``index.md`` for README.md up to its third heading."""

_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
_CODE = re.compile(r"(^```.*?^```$|`[^`\n]+`(?!\]))", re.MULTILINE | re.DOTALL)


def origin(page: str) -> str:
    """Return the repository path of a page's file."""
    return ELSEWHERE.get(page) or MADE.get(page) or f"docs/{page}"


def pages() -> dict[str, str]:
    """Return the page of each file of the repository."""
    own = {
        path.relative_to(ROOT).as_posix(): path.relative_to(ROOT / "docs").as_posix()
        for path in sorted((ROOT / "docs").rglob("*.md"))
    }
    return own | {file: page for page, file in (*ELSEWHERE.items(), *MADE.items())}


def text_of(page: str) -> str:
    """Return a page's Markdown with links rewritten for the site."""
    if page == "adr/index.md":
        return decisions()
    text = at_home((ROOT / origin(page)).read_text(encoding="utf-8"), page, origin(page))
    if README_BEGINNING in text:
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        beginning = "\n## ".join(readme.split("\n## ")[:2])
        text = text.replace(README_BEGINNING, at_home(beginning, page, "README.md").strip())
    return text


def at_home(text: str, page: str, file: str) -> str:
    """Rewrite the links of ``text`` from ``file`` for the location of ``page``.

    Links to files that are pages point to the pages, and links to pictures in ``docs`` to the
    pictures. Other files are named by their path in the repository.
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
    """Return the targets of a text's links and pictures."""
    found: list[str] = []

    def noted(prose: str) -> str:
        found.extend(link for _, _, link in _LINK.findall(prose))
        return prose

    outside_code(text, noted)
    return found


def target(link: str, file: str) -> tuple[str | None, str]:
    """Return the repository path and the anchor of a link in ``file``.

    The path is None for links within the page and for external links.
    """
    path, marker, anchor = link.partition("#")
    if not path or ":" in path:
        return None, marker + anchor
    joined = posixpath.normpath(posixpath.join(posixpath.dirname(file), path))
    return joined, marker + anchor


def outside_code(text: str, change: Callable[[str], str]) -> str:
    """Apply a change to all text except code."""
    parts = _CODE.split(text)
    return "".join(part if i % 2 else change(part) for i, part in enumerate(parts))


def decisions() -> str:
    """Return the index page of the decision records."""
    lines = [
        "# Decisions",
        "",
        "Each page records one decision and its reasons. Where a page notes that its figures date "
        "from the decision, the current ones are in [accuracy](../accuracy.md) and "
        "[performance](../performance.md).",
        "",
    ]
    for path in decision_files():
        title = path.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")
        lines.append(f"- [{title}]({path.name})")
    return "\n".join(lines) + "\n"


def decision_files() -> list[Path]:
    """Return the files of the decision records, in order."""
    return sorted((ROOT / "docs" / "adr").glob("[0-9]*.md"))
