"""Every figure on a page is backed by the pages of measurements or listed as a fact."""

from __future__ import annotations

import json
import re
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML
from support.figures import EVIDENCE, section, stated, unbacked
from support.followed import ROOT

FACTS: dict[str, dict[str, list[str]]] = YAML(typ="safe").load(
    (Path(__file__).parent / "facts.yaml").read_text(encoding="utf-8")
)
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/*.md", "docs/*/*.md", "plugins/**/*.md", "examples/**/*.md")
    for path in ROOT.glob(pattern)
    # 'tactile train-force' writes the data sheets of networks
    if path.name != "CHANGELOG.md" and path.parent.name != "shipped"
)
MEASURED = json.loads((ROOT / "benchmarks" / "accuracy.json").read_text(encoding="utf-8"))
ACCURACY = """\
# Accuracy

## Six LEDs

| what | measured |
| --- | --- |
| another grid | 1.39° |

### Grooves

0.52 mm where 0.50 mm is true; 14 of the 14.

## Markers

0.28 px
"""


@cache
def text_of(page: str) -> str:
    """Return the Markdown of a page."""
    return (ROOT / page).read_text(encoding="utf-8")


def parts(page: str) -> dict[str, str]:
    """Return the sections of a page by heading."""
    halves = (part.partition("\n") for part in text_of(page).split("\n## ")[1:])
    return {heading: text for heading, _, text in halves}


def facts_of(page: str) -> list[str]:
    """Return the figures that are listed as facts for a page."""
    return [fact for group in FACTS.get(page, {}).values() for fact in group]


@pytest.mark.parametrize("page", [page for page in PAGES if page not in EVIDENCE])
def test_every_figure_on_a_page_is_measured_or_a_fact(page: str) -> None:
    assert unbacked(page, text_of(page), facts_of(page), text_of) == []


@pytest.mark.parametrize("page", sorted(FACTS))
def test_every_listed_fact_is_on_its_page(page: str) -> None:
    figures = stated(text_of(page))
    assert [fact for fact in facts_of(page) if fact not in figures] == []


@pytest.mark.parametrize("row", MEASURED, ids=lambda row: str(row["name"]))
def test_the_accuracy_page_states_the_results_of_the_benchmark(row: dict[str, Any]) -> None:
    lines = [line for line in text_of(EVIDENCE[0]).splitlines() if f"`{row['command']}`" in line]
    assert lines, row["command"]
    figures = [*row["values"].values(), *row["control"].values()]
    on_page = {float(number) for number in re.findall(r"\d+(?:\.\d+)?", " ".join(lines))}
    assert [f"{figure:.3g}" for figure in figures if float(f"{figure:.3g}") not in on_page] == []


SETTING = re.compile(r"(\d[\d.]*) \(`([A-Z_]+)\.(\w+)`\)")
"""A value with the parameter that holds it: ``0.04 (`FUSION.imprint_changed`)``."""


@pytest.mark.parametrize("page", [page for page in PAGES if SETTING.search(text_of(page))])
def test_a_setting_on_a_page_is_that_of_the_code(page: str) -> None:
    for value, holder, name in SETTING.findall(text_of(page)):
        (module,) = (
            path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
            for path in (ROOT / "tactile_core").rglob("*.py")
            if f"\nclass {holder}:" in path.read_text(encoding="utf-8")
        )
        assert getattr(getattr(import_module(module), holder), name) == float(value)


def test_the_limit_of_slip_names_its_parameter_wherever_it_stands() -> None:
    pages = (EVIDENCE[0], "docs/adr/0043-unexplained-change-of-the-imprint.md")
    assert all("imprint_changed" in text_of(page) for page in pages)


@pytest.mark.parametrize("page", EVIDENCE)
def test_every_section_of_measurements_names_its_command(page: str) -> None:
    exempt = {"Limits", "Recordings that were not available"}
    figures = {heading: text for heading, text in parts(page).items() if stated(text)}
    assert [h for h in figures if h not in exempt and "ommand" not in figures[h]] == []


@pytest.mark.parametrize("page", EVIDENCE)
def test_every_file_named_in_a_command_exists(page: str) -> None:
    named = re.findall(
        r"(?:benchmarks|docs|examples|plugins|(?<![-\w]/)tests)/[\w/.-]+\.\w+", text_of(page)
    )
    assert named
    assert [path for path in named if not (ROOT / path).exists()] == []


def unbacked_in(
    text: str, page: str = "docs/reference/rigs.md", facts: tuple[str, ...] = ()
) -> list[str]:
    """Return the unbacked figures of a text, with :data:`ACCURACY` as the accuracy page."""
    return unbacked(page, text, facts, {EVIDENCE[0]: ACCURACY}.__getitem__)


def test_a_figure_that_links_to_its_section_is_backed() -> None:
    assert unbacked_in("Wrong by [1.39°](accuracy.md#six-leds).") == []
    assert unbacked_in("[1.39°](docs/reference/accuracy.md#six-leds)", page="README.md") == []
    assert unbacked_in("Slips: [14 of the 14](accuracy.md#grooves).") == []


@pytest.mark.parametrize(
    "text",
    [
        "Wrong by 1.39°.",
        "Wrong by [1.3°](accuracy.md#six-leds).",
        "Wrong by [1.4°](accuracy.md#six-leds).",
        "Wrong by [0.28 px](accuracy.md#six-leds).",
        "Wrong by [1.39°](accuracy.md#no-such-section).",
        "Wrong by [1.39°](accuracy.md).",
        "Wrong by [1.39°](rigs.md#six-leds).",
        "All [13 of the 14](accuracy.md#grooves).",
    ],
)
def test_a_changed_figure_or_a_wrong_link_is_found(text: str) -> None:
    assert len(unbacked_in(text)) == 1


@pytest.mark.parametrize(
    "figure",
    [
        *("2 mm", "0.987", "640 × 480 pixels", "14 of the 14", "30 Hz", "−3 %", "+0.2 %"),
        *("ten times", "two fifths of the time", "28 lifts", "eleven frames", "twice as many"),
        *("2 to 4 %", "4.5 to 6 bits", "21 ms", "0.145 MPa", "5°", "half the time"),
    ],
)
def test_figures_are_recognised(figure: str) -> None:
    assert unbacked_in(f"It is {figure}, and so on.") == [figure]
    assert unbacked_in(f"| what | {figure} |") == [figure]
    assert unbacked_in(f"It is {figure}, and so on.", facts=(figure,)) == []


@pytest.mark.parametrize(
    "text", ["```sh\n5 mm\n```", "`5 mm`", "<!-- 5 mm -->", "# 5. Circles", "3. Third, note 12"]
)
def test_code_comments_and_numbering_are_not_figures(text: str) -> None:
    assert unbacked_in(text) == []


def test_a_section_ends_at_the_next_heading_of_its_level() -> None:
    assert "0.52 mm" in str(section(ACCURACY, "six-leds"))
    assert "0.28 px" not in str(section(ACCURACY, "six-leds"))
    assert section(ACCURACY, "nowhere") is None
