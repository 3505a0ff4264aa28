"""The documentation site: its navigation, links and pictures are valid. Needs no site generator."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import site_links
import site_pictures
import stage_site
from ruamel.yaml import YAML

ROOT = site_links.ROOT
CONFIG = YAML(typ="safe").load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
ADRS = site_links.decision_files()
DECISIONS = [f"adr/{path.name}" for path in ADRS]


def leaves(nav: Any) -> Iterator[str]:
    """Yield the pages of a navigation in order."""
    if isinstance(nav, str):
        yield nav
    else:
        for part in nav.values() if isinstance(nav, dict) else nav:
            yield from leaves(part)


NAV = [*leaves(CONFIG["nav"]), *DECISIONS]
TEXTS = {page: site_links.text_of(page) for page in NAV}


def anchors(text: str) -> set[str]:
    """Return the link anchors of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w]+", "-", heading.lower()).strip("-") for heading in headings}


def test_every_page_is_in_the_navigation_once() -> None:
    assert sorted(NAV) == sorted(site_links.pages().values())


@pytest.mark.parametrize("page", NAV)
def test_every_link_of_a_page_is_valid(page: str) -> None:
    drawn = {site_links.GENERATED + name for name in drawn_names()}
    for link in site_links.links(TEXTS[page]):
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        to = posixpath.normpath(posixpath.join(posixpath.dirname(page), path)) if path else page
        known = to in TEXTS or to in drawn or (ROOT / "docs" / to).is_file()
        assert known, link
        assert not anchor or anchor in anchors(TEXTS[to]), link


@pytest.mark.parametrize("page", NAV)
def test_every_linked_file_in_the_repository_exists(page: str) -> None:
    file = site_links.origin(page)
    if not (ROOT / file).is_file():
        return
    for link in site_links.links((ROOT / file).read_text(encoding="utf-8")):
        path, _ = site_links.target(link, file)
        made_later = path in site_links.MADE.values() or str(path).startswith(
            "docs/" + site_links.GENERATED
        )
        assert path is None or made_later or (ROOT / path).exists(), link


def test_the_first_page_begins_like_the_readme_and_does_not_repeat_it() -> None:
    first = TEXTS["index.md"]
    assert first.startswith("# tactile-core")
    assert "make demo" in first
    assert "(images/relief.png)" in first
    assert "First script" not in first
    assert "make demo" not in (ROOT / "docs" / "index.md").read_text(encoding="utf-8")


def test_the_list_of_all_pages_has_them_all() -> None:
    docs = ROOT / "docs"
    listed = (docs / "index.md").read_text(encoding="utf-8")
    pages = {path.relative_to(docs).as_posix() for path in docs.rglob("*.md")}
    each = [page for page in pages - {"index.md"} if not page.startswith("adr/")]
    assert [page for page in (*each, "adr/") if f"]({page})" not in listed] == []


def test_a_decision_is_a_page_and_there_are_few() -> None:
    decisions = {path.name: path.read_text("utf-8").splitlines() for path in ADRS}
    assert len(decisions) <= 45
    assert [name for name, lines in decisions.items() if len(lines) > 45] == []
    assert [name for name, lines in decisions.items() if max(map(len, lines)) > 100] == []


def test_the_pages_show_exactly_the_generated_pictures() -> None:
    pattern = re.escape(site_links.GENERATED) + r"([\w.-]+)"
    shown = {name for text in TEXTS.values() for name in re.findall(pattern, text)}
    pictures = dict(site_pictures.pictures())
    assert shown == set(pictures)
    assert all(png.startswith(b"\x89PNG") and len(png) < 500_000 for png in pictures.values())


def test_links_in_code_are_unchanged() -> None:
    text = "a [b](../README.md) and\n```python\nx[b](../README.md)\n```\n"
    moved = site_links.at_home(text, "adr/index.md", "docs/rigs.md")
    assert moved == "a b (`README.md`) and\n```python\nx[b](../README.md)\n```\n"


def drawn_names() -> list[str]:
    """Return the names of the generated pictures without drawing them."""
    return [*(f"{name}.png" for name in site_pictures.RIGS), "presses.png"]


def test_the_folder_for_the_generator_has_every_page_and_needs_no_plugin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage_site, "STAGE", tmp_path / "stage")
    stage_site.main()
    pages = tmp_path / "stage" / "pages"
    config = YAML(typ="safe").load((tmp_path / "stage" / "mkdocs.yml").read_text("utf-8"))
    assert list(leaves(config["nav"])) == NAV
    assert {path.relative_to(pages).as_posix() for path in pages.rglob("*.md")} == set(NAV)
    assert (pages / site_links.GENERATED / "presses.png").is_file()
    assert not {"hooks", "plugins"} & set(config)
