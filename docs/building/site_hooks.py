"""MkDocs hooks: pages from outside ``docs``, their links, and generated pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import site_links
import site_pictures
from mkdocs.structure.files import File, Files

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add every decision record to the navigation."""
    assert config.nav is not None
    for section in config.nav:
        if isinstance(section, dict) and "Decisions" in section:
            section["Decisions"] += [f"adr/{path.name}" for path in site_links.decision_files()]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages from outside ``docs``, and the generated pictures."""
    for page in (*site_links.ELSEWHERE, *site_links.MADE):
        files.append(File.generated(config, page, content=site_links.text_of(page)))
    for name, content in site_pictures.pictures():
        files.append(File.generated(config, site_links.GENERATED + name, content=content))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Rewrite links to point to pages of the site, wherever their files are."""
    return site_links.text_of(page.file.src_uri)
