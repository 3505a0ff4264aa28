"""Signals during the work, closed streams, and concurrent writers."""

from __future__ import annotations

import signal
from random import Random

from fuzz import recipes
from fuzz.attempt import Attempt
from fuzz.faults import Fault
from fuzz.sandbox import Sandbox

_AGAIN = [*recipes.CALIBRATE[:-3], "--out", "bundle"]
_ENDS: dict[int, frozenset[int]] = {
    signal.SIGINT: frozenset({0, 130}),
    signal.SIGTERM: frozenset({0, 143, -signal.SIGTERM}),
    signal.SIGKILL: frozenset({0, -signal.SIGKILL}),
    signal.SIGHUP: frozenset({0, 129, -signal.SIGHUP}),
}


def in_the_middle(box: Sandbox, rng: Random) -> Attempt:
    """Return a command that receives a signal at one of its file operations."""
    words = list(rng.choice((*recipes.WRITING, _AGAIN, _AGAIN)))
    number = rng.choice(
        (signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGHUP)
    )
    # SIGKILL, and SIGHUP without a handler, leave no chance to clean up
    return Attempt(
        words,
        fault=Fault(at=rng.randrange(14), signal=number),
        ours=(box.work / "bundle",) if words == _AGAIN else (),
        codes=_ENDS[number],
        may_litter=number in (signal.SIGKILL, signal.SIGHUP),
    )


def streams(box: Sandbox, rng: Random) -> Attempt:
    """Return a command with a closed or full stdout or stderr."""
    words = list(rng.choice((*recipes.ALL, recipes.PROFILES, recipes.SCHEMA, ["--help"])))
    if rng.random() < 0.2:
        words += ["--nothing"]
    wires = rng.choice(
        (
            "stdout-gone",
            "stdout-gone",
            "stdout-full",
            "stdout-closed",
            "stderr-gone",
            "stderr-full",
            "stderr-closed",
        )
    )
    codes = {"stdout-gone": {0, 2}, "stdout-full": {0, 1, 2}}.get(wires, {0, 1, 2})
    return Attempt(words, wires=wires, codes=frozenset(codes))


def two_writers(box: Sandbox, rng: Random) -> Attempt:
    """Return a command that two or three processes run concurrently."""
    words = list(rng.choice((*recipes.WRITING, _AGAIN, _AGAIN, _AGAIN)))
    return Attempt(
        words,
        times=rng.choice((2, 2, 3)),
        ours=(box.work / "bundle",) if words == _AGAIN else (),
        codes=frozenset({0, 1, 2}),
    )


def from_a_shell(box: Sandbox, rng: Random) -> Attempt:
    """Return a command for a new interpreter, with other locales or a signal during startup."""
    words = list(
        rng.choice((recipes.RUN, recipes.CALIBRATE, recipes.NEW, ["profiles"], recipes.VALIDATE))
    )
    environment = rng.choice(
        (
            {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
            {"PYTHONIOENCODING": "ascii"},
            {"PYTHONIOENCODING": "latin-1"},
            {"TERM": "dumb", "NO_COLOR": "1"},
        )
    )
    if rng.random() < 0.5:
        number = rng.choice((signal.SIGINT, signal.SIGINT, signal.SIGTERM))
        seconds = rng.choice((0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2))
        return Attempt(
            words, alone=True, signal=(number, seconds), codes=_ENDS[number] | {-signal.SIGINT}
        )
    name = rng.choice(("é.png", "\udcff.png", "漢.png", "a b.png"))
    (box.work / "frames" / "rest.png").rename(box.work / "frames" / name)
    return Attempt(words, alone=True, environment=environment, cpu_s=20)
