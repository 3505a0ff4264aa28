"""Runs cases in sequence: each mutates the valid inputs or extends a case with a new behaviour."""

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
"""Largest number of mutations in a case."""

_EXTENDED = 0.35
"""Share of the cases that extend a case with a new behaviour."""


@dataclass(frozen=True)
class Case:
    """``area:12.40.7``: the first number selects the attempt; each number is a mutation."""

    area: str
    numbers: tuple[int, ...]
    seed: int = 0

    @classmethod
    def parse(cls, words: str, seed: int) -> Case:
        """Parse a printed case."""
        area, _, numbers = words.partition(":")
        if area not in AREAS or not numbers:
            raise SystemExit(f"{words}: a case is AREA:NUMBER; the areas are {', '.join(AREAS)}")
        return cls(area, tuple(map(int, numbers.split("."))), seed)

    def __str__(self) -> str:
        return f"{self.area}:{'.'.join(map(str, self.numbers))}"

    def random(self, what: str) -> Random:
        """Return a random generator that depends only on the case."""
        return Random(f"{self.seed}/{self.area}/{what}")

    def prepare(self, box: Sandbox) -> Attempt:
        """Choose the attempt and corrupt its inputs."""
        attempt = AREAS[self.area][0](box, self.random(f"what {self.numbers[0]}"))
        for number in self.numbers:
            attempt.corrupt(self.random(f"how {number}"))
        return attempt


@dataclass(frozen=True)
class Result:
    """The result of a case.

    Attributes
    ----------
    broken : tuple of str
        The broken promises.
    behaviour : str
        Exit status and message, without details of this case.
    output : str
        The command and its output, for the report of a failure.
    """

    case: Case
    broken: tuple[str, ...]
    behaviour: str
    output: str
    seconds: float


def try_case(case: Case, corpus: Path, keep: Path | None = None) -> Result:
    """Run one case in its own sandbox, and delete the sandbox unless ``keep`` is given."""
    begun = perf_counter()
    root = keep or Path(tempfile.mkdtemp(prefix="tactile-fuzz-")).resolve()
    try:
        broken, behaviour, output = _tried(case, Sandbox(root, corpus))
    except Exception:
        broken, behaviour, output = ("the harness failed",), "", traceback.format_exc()
    finally:
        if keep is None:
            shutil.rmtree(root, ignore_errors=True)
    return Result(case, broken, behaviour, output, perf_counter() - begun)


def _tried(case: Case, box: Sandbox) -> tuple[tuple[str, ...], str, str]:
    """Return broken promises, behaviour and output."""
    attempt = case.prepare(box)
    before = box.listing()
    outcomes = run(attempt, box)
    _find_the_place(attempt, box, outcomes)
    broken = tuple(sorted(set(broken_promises(attempt, before, box, outcomes))))
    behaviour = " | ".join(f"{one.code} {message_of(one)}" for one in outcomes)
    if attempt.call is not None:
        behaviour = str(outcomes[0].report.get("raised", ["no error"])[:3])
    stderr = [one.stderr.decode("utf-8", "replace")[-1500:] for one in outcomes]
    return broken, behaviour, "\n".join([attempt.command_line(), *stderr])


def hunt(
    area: str, numbers: range, seed: int, corpus: Path, done: Callable[[Result], None]
) -> None:
    """Run one case per number, in sequence."""
    known: set[str] = set()
    extendable: list[Case] = []
    for number in numbers:
        rng = Random(f"{seed}/{area}/growth {number}")
        numbers_before: tuple[int, ...] = ()
        if extendable and rng.random() < _EXTENDED:
            numbers_before = rng.choice(extendable).numbers
        case = Case(area, (*numbers_before, number), seed)
        result = try_case(case, corpus)
        if result.behaviour not in known and len(case.numbers) < _DEEPEST:
            extendable.append(case)
        known.add(result.behaviour)
        done(result)


def _find_the_place(attempt: Attempt, box: Sandbox, outcomes: list[Outcome]) -> None:
    """Repeat a run that reported a bug with --debug, and store the line that raised it."""
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
