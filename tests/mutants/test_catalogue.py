"""The catalogue of mutants matches the tree."""

from __future__ import annotations

from collections import Counter

import pytest

from mutants.catalogue import ROOT, Mutant, chosen, has_test, read_lists

MUTANTS = read_lists()
AREAS = (
    "preprocessing",
    "calibration",
    "integration",
    "contact",
    "markers",
    "marker_tracking",
    "displacement",
    "slip",
    "simulator",
    "bundle",
)
every = pytest.mark.parametrize("mutant", MUTANTS, ids=lambda m: f"{m.area}-{m.id}")


@every
def test_every_snippet_occurs_exactly_once_and_is_changed(mutant: Mutant) -> None:
    text = mutant.made_in(ROOT)
    assert text != (ROOT / mutant.file).read_text(encoding="utf-8")
    compile(text, mutant.file, "exec")


@every
def test_every_named_test_exists(mutant: Mutant) -> None:
    assert [test for test in mutant.tests if not has_test(test)] == []


def test_every_area_has_five_mutants_and_ids_are_unique() -> None:
    count = Counter(mutant.area for mutant in MUTANTS)
    assert [area for area in AREAS if count[area] < 5] == []
    assert max(Counter(mutant.id for mutant in MUTANTS).values()) == 1


def test_an_unknown_area_or_mutant_is_refused() -> None:
    with pytest.raises(ValueError, match="'contct'"):
        chosen(MUTANTS, ["contct"])
