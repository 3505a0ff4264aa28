"""Apply each mutant of the catalogue to a copy of the tree and report which survive."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from time import monotonic

from mutants.catalogue import Mutant, chosen, read_lists
from mutants.copies import Copy, Outcome


def main() -> int:
    """Print a line for each mutant; return 1 if one survives without a documented reason."""
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("--only", nargs="+", default=[], metavar="AREA|ID")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    try:
        mutants = chosen(read_lists(), arguments.only)
    except ValueError as error:
        parser.error(str(error))
    start = monotonic()
    with (
        tempfile.TemporaryDirectory(prefix="mutants-") as folder,
        ThreadPoolExecutor(arguments.workers) as pool,
    ):
        places = [Path(folder) / str(number) for number in range(arguments.workers)]
        copies = SimpleQueue[Copy]()
        for copy in pool.map(Copy, places):
            copies.put(copy)
        failure = _failure_without_mutants(copies, mutants)
        if failure:
            print(failure)
            return 1
        print(f"unchanged, all named tests pass ({monotonic() - start:.0f} s)", flush=True)
        outcomes = pool.map(lambda mutant: _outcome(copies, mutant), mutants)
        survived = [_reported(*pair) for pair in zip(mutants, outcomes, strict=True)]
    survivors = [m for m, survives in zip(mutants, survived, strict=True) if survives]
    print(
        f"{len(mutants) - len(survivors)} of {len(mutants)} detected, {len(survivors)} survive "
        f"({monotonic() - start:.0f} s)"
    )
    return int(any(not mutant.equivalent for mutant in survivors))


def _failure_without_mutants(copies: SimpleQueue[Copy], mutants: Sequence[Mutant]) -> str:
    """Return the named test that fails on the unchanged tree, or ""."""
    copy = copies.get()
    try:
        outcome = copy.tested(sorted({test for mutant in mutants for test in mutant.tests}))
    finally:
        copies.put(copy)
    fails = outcome.detected_by and f"{outcome.detected_by} fails on the unchanged tree"
    return outcome.trouble or fails


def _outcome(copies: SimpleQueue[Copy], mutant: Mutant) -> Outcome:
    copy = copies.get()
    try:
        return copy.mutated(mutant)
    finally:
        copies.put(copy)


def _reported(mutant: Mutant, outcome: Outcome) -> bool:
    """Print a mutant's line and return whether it survives."""
    survives = not outcome.detected_by
    result = outcome.detected_by.rpartition("::")[2] or "SURVIVES"
    if outcome.trouble:
        result = f"BROKEN: {outcome.trouble}"
    elif survives and mutant.equivalent:
        result = f"survives: {mutant.equivalent}"
    print(f"{mutant.area:<14} {mutant.id:<30} {result}", flush=True)
    return survives


if __name__ == "__main__":
    sys.exit(main())
