"""Prepare the site: python docs/building/stage_site.py.

Writes ``build/docs/``: every page as plain Markdown where the site has it, the pictures, and the
configuration. A site generator needs nothing else, so that it can be replaced.
"""

from __future__ import annotations

import shutil

import site_links
import site_pictures
from ruamel.yaml import YAML
from site_links import ROOT

STAGE = ROOT / "build" / "docs"


def main() -> None:
    """Replace the folder."""
    shutil.rmtree(STAGE, ignore_errors=True)
    pages = STAGE / "pages"
    shutil.copytree(ROOT / "docs" / "images", pages / "images")
    for page in site_links.pages().values():
        path = pages / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(site_links.text_of(page), encoding="utf-8")
    for name, png in site_pictures.pictures():
        path = pages / site_links.GENERATED / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(png)
    _write_configuration()


def _write_configuration() -> None:
    """Write ``mkdocs.yml`` for the staged pages; every decision has a place in the navigation."""
    yaml = YAML()
    config = yaml.load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    config["docs_dir"] = "pages"
    config["site_dir"] = "site"
    for section in config["nav"]:
        if "Decisions" in section:
            section["Decisions"] += [f"adr/{path.name}" for path in site_links.decision_files()]
    with (STAGE / "mkdocs.yml").open("w", encoding="utf-8") as file:
        yaml.dump(config, file)


if __name__ == "__main__":
    main()
