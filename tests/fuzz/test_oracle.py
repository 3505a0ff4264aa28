"""What the harness of bad inputs takes for a broken promise."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz.areas import AREAS
from fuzz.attempt import Attempt
from fuzz.oracle import broken_promises
from fuzz.process import Outcome
from fuzz.sandbox import Sandbox

BLAMES = "tactile: KeyboardInterrupt in fuzzed.camera; this is a bug of its author\n"
OURS = "tactile: KeyError (this is a bug; please report it)\n"


def broken(
    tmp_path: Path, stderr: str, codes: frozenset[int] = frozenset({1}), **attempt: object
) -> list[str]:
    """Return the promises that a refusal with this message breaks."""
    (tmp_path / "corpus").mkdir(parents=True)
    box = Sandbox(tmp_path / "box", tmp_path / "corpus")
    before = box.listing()
    outcome = Outcome(1, b"", stderr.encode(), {}, 0.1, 1.0, hung=False)
    made = Attempt(["run", "mine.yaml"], codes=codes, **attempt)  # type: ignore[arg-type]
    return list(broken_promises(made, before, box, [outcome]))


@pytest.mark.parametrize("named", [(), ("fuzzed",)])
def test_a_message_may_call_it_a_bug_of_the_plugin(tmp_path: Path, named: tuple[str, ...]) -> None:
    assert broken(tmp_path, BLAMES, named=named) == []


def test_no_message_may_be_about_a_bug_of_ours(tmp_path: Path) -> None:
    assert any("this is a bug" in one for one in broken(tmp_path, OURS))


def test_a_run_may_leave_out_recordings_that_it_names(tmp_path: Path) -> None:
    said = "tactile: 1 of 2 recordings could not be measured and are left out:\n  cut: no video\n"
    assert broken(tmp_path, said, codes=frozenset({0, 2})) == []
    other = broken(tmp_path / "other", "tactile: no\n", codes=frozenset({0, 2}))
    assert other == ["exit 1: tactile: no"]


def test_what_an_area_promises_besides_is_judged(tmp_path: Path) -> None:
    silent = broken(tmp_path, "tactile: no\n", judge=lambda outcome: iter(["measured in silence"]))
    assert silent == ["measured in silence"]


def test_frames_clocks_damage_and_pages_are_tried() -> None:
    assert {"frames", "clocks", "damage", "pages", "disks"} <= set(AREAS)


def test_a_refusal_names_what_it_must(tmp_path: Path) -> None:
    assert any("does not name peak" in one for one in broken(tmp_path, BLAMES, named=("peak",)))
