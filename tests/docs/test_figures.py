"""No page states a figure that the pages of measurements do not hold."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML
from support.figures import EVIDENCE, OF_ITS_TIME, section, stated, unbacked
from support.followed import ROOT

FACTS: dict[str, dict[str, list[str]]] = YAML(typ="safe").load(
    (Path(__file__).parent / "facts.yaml").read_text(encoding="utf-8")
)
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/*.md", "docs/*/*.md", "plugins/**/*.md", "examples/**/*.md")
    for path in ROOT.glob(pattern)
    if path.name != "CHANGELOG.md"
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
    """A page's Markdown."""
    return (ROOT / page).read_text(encoding="utf-8")


def parts(page: str) -> dict[str, str]:
    """The sections of a page, by heading."""
    halves = (part.partition("\n") for part in text_of(page).split("\n## ")[1:])
    return {heading: text for heading, _, text in halves}


def facts_of(page: str) -> list[str]:
    """The figures that are listed as facts for a page."""
    return [fact for group in FACTS.get(page, {}).values() for fact in group]


@pytest.mark.parametrize("page", [page for page in PAGES if page not in EVIDENCE])
def test_a_page_states_no_figure_that_is_neither_measured_nor_a_fact(page: str) -> None:
    assert unbacked(page, text_of(page), facts_of(page), text_of) == []


@pytest.mark.parametrize("page", sorted(FACTS))
def test_every_fact_that_is_listed_is_on_its_page(page: str) -> None:
    there = stated(text_of(page))
    assert [fact for fact in facts_of(page) if fact not in there] == []


@pytest.mark.parametrize("row", MEASURED, ids=lambda row: str(row["name"]))
def test_the_page_of_accuracy_states_what_the_benchmark_has_measured(row: dict[str, Any]) -> None:
    lines = [line for line in text_of(EVIDENCE[0]).splitlines() if f"`{row['command']}`" in line]
    assert lines, row["command"]
    figures = [*row["values"].values(), *row["control"].values()]
    said = re.findall(r"\d+(?:\.\d+)?", " ".join(lines))
    assert [f"{figure:.3g}" for figure in figures if f"{figure:.3g}" not in said] == []


@pytest.mark.parametrize("page", EVIDENCE)
def test_every_section_of_measurements_says_by_what_command(page: str) -> None:
    silent = {"Limits", "Recordings that were not available"}
    figures = {heading: text for heading, text in parts(page).items() if stated(text)}
    assert [h for h in figures if h not in silent and "ommand" not in figures[h]] == []


@pytest.mark.parametrize("page", EVIDENCE)
def test_every_file_that_a_command_names_exists(page: str) -> None:
    named = re.findall(r"(?:benchmarks|docs|examples|tests)/[\w/.-]+\.\w+", text_of(page))
    assert named
    assert [path for path in named if not (ROOT / path).exists()] == []


def judged(
    text: str, page: str = "docs/reference/rigs.md", facts: tuple[str, ...] = ()
) -> list[str]:
    """What is wrong with a text, where :data:`ACCURACY` is the page of accuracy."""
    return unbacked(page, text, facts, {EVIDENCE[0]: ACCURACY}.__getitem__)


def test_a_figure_that_links_to_the_section_that_holds_it_is_backed() -> None:
    assert judged("Wrong by [1.39°](accuracy.md#six-leds).") == []
    assert judged("[1.39°](docs/reference/accuracy.md#six-leds)", page="README.md") == []
    assert judged("Slips: [14 of the 14](accuracy.md#grooves).") == []


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
def test_a_figure_that_was_changed_or_is_held_elsewhere_is_found(text: str) -> None:
    assert len(judged(text)) == 1


@pytest.mark.parametrize(
    "figure",
    [
        *("2 mm", "0.987", "640 × 480 pixels", "14 of the 14", "30 Hz", "−3 %", "+0.2 %"),
        *("ten times", "two fifths of the time", "28 lifts", "eleven frames", "twice as many"),
        *("2 to 4 %", "4.5 to 6 bits", "21 ms", "0.145 MPa", "5°", "half the time"),
    ],
)
def test_what_a_figure_is(figure: str) -> None:
    assert judged(f"It is {figure}, and so on.") == [figure]
    assert judged(f"| what | {figure} |") == [figure]
    assert judged(f"It is {figure}, and so on.", facts=(figure,)) == []


@pytest.mark.parametrize(
    "text", ["```sh\n5 mm\n```", "`5 mm`", "<!-- 5 mm -->", "# 5. Circles", "3. Third, note 12"]
)
def test_what_states_no_figure(text: str) -> None:
    assert judged(text) == []


def test_a_decision_that_says_so_keeps_the_figures_of_its_time() -> None:
    assert judged(f"# 5. Why\n\n{OF_ITS_TIME}\n\n5 mm", page="docs/adr/0005-why.md") == []
    assert judged("# 5. Why\n\n5 mm", page="docs/adr/0005-why.md") == ["5 mm"]
    assert judged(f"{OF_ITS_TIME}\n\n5 mm") == ["5 mm"]


def test_a_section_ends_where_the_next_as_high_begins() -> None:
    assert "0.52 mm" in str(section(ACCURACY, "six-leds"))
    assert "0.28 px" not in str(section(ACCURACY, "six-leds"))
    assert section(ACCURACY, "nowhere") is None
