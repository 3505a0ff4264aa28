"""Cases in turn: each grows from the good inputs or from a case that did something new."""

from __future__ import annotations

import shutil
import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from time import perf_counter

from fuzz.areas import AREAS
from fuzz.attempt import Attempt
from fuzz.oracle import broken_promises, message_of
from fuzz.process import Outcome, run
from fuzz.sandbox import Sandbox

_DEEPEST = 4
"""So many mutations on top of each other at the most."""
_GROWN = 0.35
"""This share of the cases grows from one that did something new."""


@dataclass(frozen=True)
class Case:
    """``area:12.40.7``: the first number chooses what is tried, each one is a mutation."""

    area: str
    numbers: tuple[int, ...]
    seed: int = 0

    @classmethod
    def parse(cls, words: str, seed: int) -> Case:
        """Read a case as it is printed."""
        area, _, numbers = words.partition(":")
        if area not in AREAS or not numbers:
            raise SystemExit(f"{words}: a case is AREA:NUMBER, with an area of {', '.join(AREAS)}")
        return cls(area, tuple(map(int, numbers.split("."))), seed)

    def __str__(self) -> str:
        return f"{self.area}:{'.'.join(map(str, self.numbers))}"

    def random(self, what: str) -> Random:
        """Chances that are the same whenever the case is tried."""
        return Random(f"{self.seed}/{self.area}/{what}")

    def prepare(self, box: Sandbox) -> Attempt:
        """Choose what is tried and spoil its inputs."""
        attempt = AREAS[self.area][0](box, self.random(f"what {self.numbers[0]}"))
        for number in self.numbers:
            attempt.spoil(self.random(f"how {number}"))
        return attempt


@dataclass(frozen=True)
class Result:
    """How a case went.

    Attributes
    ----------
    broken : tuple of str
        The promises that were not kept.
    behaviour : str
        Exit status and message, without what is of this case alone.
    said : str
        The command and what it printed, for whoever reads of the failure.
    """

    case: Case
    broken: tuple[str, ...]
    behaviour: str
    said: str
    seconds: float


def try_case(case: Case, corpus: Path, keep: Path | None = None) -> Result:
    """Try one case in a sandbox of its own, which is deleted unless it is to be kept."""
    begun = perf_counter()
    root = keep or Path(tempfile.mkdtemp(prefix="tactile-fuzz-")).resolve()
    try:
        broken, behaviour, said = _tried(case, Sandbox(root, corpus))
    except Exception:
        broken, behaviour, said = ("the harness failed",), "", traceback.format_exc()
    finally:
        if keep is None:
            shutil.rmtree(root, ignore_errors=True)
    return Result(case, broken, behaviour, said, perf_counter() - begun)


def _tried(case: Case, box: Sandbox) -> tuple[tuple[str, ...], str, str]:
    """Broken promises, behaviour and words."""
    attempt = case.prepare(box)
    before = box.listing()
    outcomes = run(attempt, box)
    _find_the_place(attempt, box, outcomes)
    broken = tuple(sorted(set(broken_promises(attempt, before, box, outcomes))))
    behaviour = " | ".join(f"{one.code} {message_of(one)}" for one in outcomes)
    if attempt.call is not None:
        behaviour = str(outcomes[0].report.get("raised", ["no error"])[:3])
    heard = [one.stderr.decode("utf-8", "replace")[-1500:] for one in outcomes]
    return broken, behaviour, "\n".join([attempt.said(), *heard])


def hunt(
    area: str, numbers: range, seed: int, corpus: Path, done: Callable[[Result], None]
) -> None:
    """Try one case for each number, in turn."""
    known: set[str] = set()
    grown: list[Case] = []
    for number in numbers:
        chances = Random(f"{seed}/{area}/growth {number}")
        numbers_before: tuple[int, ...] = ()
        if grown and chances.random() < _GROWN:
            numbers_before = chances.choice(grown).numbers
        case = Case(area, (*numbers_before, number), seed)
        result = try_case(case, corpus)
        if result.behaviour not in known and len(case.numbers) < _DEEPEST:
            grown.append(case)
        known.add(result.behaviour)
        done(result)


def _find_the_place(attempt: Attempt, box: Sandbox, outcomes: list[Outcome]) -> None:
    """Where a bug was raised: tried once more with --debug, which changes nothing else."""
    if attempt.call is not None or not any(b"this is a bug" in one.stderr for one in outcomes):
        return
    again = Attempt(**{**vars(attempt), "words": [*attempt.words, "--debug"], "times": 1})
    place = _deepest(run(again, box)[0].stderr.decode("utf-8", "replace"))
    for one in outcomes:
        one.report["place"] = place  # type: ignore[index]


def _deepest(debugged: str) -> str:
    places = [line.strip() for line in debugged.splitlines() if "/tactile_" in line]
    last = places[-1].rpartition("/tactile_")[2] if places else "?"
    lines = [line for line in debugged.splitlines() if line and not line.startswith(" ")]
    kind = lines[-1].partition(":")[0] if lines else "?"
    return f"{kind} from {last.replace(chr(34), '')}"
