"""``python -m fuzz``: runs thousands of bad inputs and faults, and reports broken promises.

The cases depend only on the seed. ``--case`` repeats one of them.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import Future, as_completed
from pathlib import Path
from time import perf_counter

from fuzz import crew
from fuzz.areas import AREAS
from fuzz.hunt import Case, Result

_CASES_PER_TASK = 20
"""Number of cases that a worker runs in one task."""


def main() -> int:
    """Run the cases, print a table and each fault once; return 1 if there is a fault."""
    wanted = _arguments()
    begun = perf_counter()
    with tempfile.TemporaryDirectory(prefix="tactile-fuzz-") as folder:
        place = Path(folder).resolve()
        os.environ["TMPDIR"] = str(place)
        with crew.crew(wanted.workers, place) as workers:
            if wanted.case:
                cases = [Case.parse(words, wanted.seed) for words in wanted.case]
                results = [
                    workers.submit(crew.try_one, case, wanted.keep).result() for case in cases
                ]
            else:
                tasks = [workers.submit(crew.try_some, *task) for task in _tasks(wanted)]
                results = list(_collected(tasks, sum(_counts(wanted).values())))
    _report(results, perf_counter() - begun, wanted)
    return 1 if any(result.broken for result in results) else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=sum(n for _, n in AREAS.values()))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", action="append", choices=list(AREAS), help="an area; repeat it")
    parser.add_argument("--case", action="append", help="AREA:NUMBER, as printed for a failure")
    parser.add_argument("--keep", type=Path, help="with --case: folder for its sandbox")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    return parser.parse_args()


def _counts(wanted: argparse.Namespace) -> dict[str, int]:
    areas = {area: AREAS[area][1] for area in wanted.only or AREAS}
    scale = wanted.cases / sum(areas.values())
    if wanted.only and wanted.cases == sum(n for _, n in AREAS.values()):
        scale = 1.0
    return {area: math.ceil(count * scale) for area, count in areas.items()}


def _tasks(wanted: argparse.Namespace) -> list[tuple[str, range, int]]:
    """Interleave the areas, so that the slow ones are not all at the end."""
    tasks = [
        (start / count, area, range(start, min(start + _CASES_PER_TASK, count)))
        for area, count in _counts(wanted).items()
        for start in range(0, count, _CASES_PER_TASK)
    ]
    ordered = sorted(tasks, key=lambda task: task[:2])
    return [(area, numbers, wanted.seed) for _, area, numbers in ordered]


def _collected(tasks: list[Future[list[Result]]], total: int) -> Iterator[Result]:
    """Yield the results in order of completion, and print each new fault immediately."""
    from tactile_core.cli.output import Bar

    count, known = 0, set[str]()
    with Bar() as bar:
        bar.stage("running cases", 1.0)
        for task in as_completed(tasks):
            for result in task.result():
                count += 1
                for promise in sorted({*result.broken} - known):
                    print(f"{count}/{total} {result.case}: {promise}", file=sys.stderr, flush=True)
                known |= {*result.broken}
                yield result
            bar.fraction(count / total)


def _report(results: list[Result], seconds: float, wanted: argparse.Namespace) -> None:
    from tactile_core.cli.output import table_lines

    rows = []
    for area in AREAS:
        of_area = [result for result in results if result.case.area == area]
        if of_area:
            behaviours = len({result.behaviour for result in of_area})
            failed = sum(bool(result.broken) for result in of_area)
            spent = sum(result.seconds for result in of_area)
            rows.append([area, str(len(of_area)), str(behaviours), str(failed), f"{spent:.0f}"])
    rows.append(["all", str(len(results)), "", str(sum(bool(r.broken) for r in results)), ""])
    for line in table_lines(["area", "cases", "behaviours", "failed", "seconds"], rows):
        print(line)
    print(f"{seconds:.0f} s with {wanted.workers} workers, seed {wanted.seed}")
    faults: defaultdict[str, list[Result]] = defaultdict(list)
    for result in results:
        for promise in result.broken:
            faults[promise].append(result)
    for promise, found in sorted(faults.items(), key=lambda item: -len(item[1])):
        ordered = sorted(found, key=lambda result: (len(result.case.numbers), str(result.case)))
        cases = " ".join(f"--case {result.case}" for result in ordered[:3])
        print(f"\n{promise}\n    {len(found)} times; repeat with:", end=" ")
        print(f"make fuzz FUZZ='--seed {wanted.seed} {cases}'")
        for line in ordered[0].output.splitlines()[:14]:
            print(f"    | {line[:300]!r}")
    if wanted.case:
        for result in results:
            print(result.case, result.behaviour)


if __name__ == "__main__":
    sys.exit(main())
