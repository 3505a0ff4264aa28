"""Slip at speed and of plates wider than the view: ``python benchmarks/slip_speed.py``.

The seeds 3000 to 3047 take about 10 minutes.

Virtual objects, sheared or turned (``experiments/slip_at_speed.py``), with the true height and
contact area. *Warned*: before the first frame of gross slip, where there is a frame between half
and gross slip. *False*: frames before gross slip in which half or more sticks.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from slip_thresholds import auc

from experiments.slip_at_speed import Passage, passages
from experiments.slip_sequences import GROSS, HALF

SEEDS = 3000, 3048
"""Not used for any constant."""


def wilson(found: int, of: int) -> str:
    """Return a share with its 95 % interval."""
    if not of:
        return "-"
    z, share = 1.96, found / of
    middle = (share + z**2 / 2 / of) / (1 + z**2 / of)
    half = z * np.sqrt(share * (1 - share) / of + z**2 / 4 / of**2) / (1 + z**2 / of)
    return f"{found}/{of} [{100 * (middle - half):.0f}, {100 * (middle + half):.0f}] %"


def row(name: str, some: Sequence[Passage]) -> str:
    """Score some passages; the areas leave out frames that stick again after gross slip."""
    moved = [one for one in some if not one.held]
    keeps = [
        (np.arange(len(one.degree)) < one.first_gross) | (one.stick_share < GROSS) for one in moved
    ]
    degree = np.concatenate([one.degree[kept] for one, kept in zip(moved, keeps, strict=True)])
    stick = np.concatenate([one.stick_share[kept] for one, kept in zip(moved, keeps, strict=True)])
    warned, could, all_warned = 0, 0, []
    for one in moved:
        end = one.first_gross
        if 0 < end < len(one.degree):
            alarm = bool(one.alarm[:end].any())
            all_warned.append(alarm)
            possible = bool((one.stick_share[:end] < HALF).any())
            could, warned = could + possible, warned + (possible and alarm)
    false = [_false(one) for one in some if not one.held]
    controls = [_false(one) for one in some if one.held]
    return (
        f"{name:26}{len(moved):4} gross {auc(degree, stick < GROSS):.3f} "
        f"half {auc(degree, stick < HALF):.3f} warned {wilson(warned, could)} "
        f"(of all {wilson(sum(all_warned), len(all_warned))}) "
        f"false {_rate(false)} held {_rate(controls)} "
        f"controls with gross slip reported "
        f"{wilson(sum(_called(one) for one in some if one.held), len(controls))}"
    )


def _false(one: Passage) -> tuple[int, int]:
    holds = one.stick_share[: one.first_gross] >= HALF
    return int((one.alarm[: one.first_gross] & holds).sum()), int(holds.sum())


def _called(one: Passage) -> bool:
    return any(state.state == "slip" for state in one.states) and bool(
        one.stick_share.min() >= HALF
    )


def _rate(counts: Sequence[tuple[int, int]]) -> str:
    false, of = (sum(column) for column in zip(*counts, strict=True)) if counts else (0, 0)
    return f"{false} of {of} ({100 * false / max(of, 1):.1f} %)"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=int, nargs=2, default=SEEDS, metavar=("FIRST", "END"))
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    with ProcessPoolExecutor(given.processes) as pool:
        found = [one for some in pool.map(passages, range(*given.seeds)) for one in some]
    plans = [one.case.plan for one in found]
    groups = {
        "sheared": [not plan.turned for plan in plans],
        "sheared, border in view": [not p.turned and p.kind != "plate" for p in plans],
        "sheared, wider than view": [not p.turned and p.kind == "plate" for p in plans],
        "sheared, 0.3 to 1 mm/s": [
            not one.case.plan.turned and not one.case.at_camera_rate for one in found
        ],
        "sheared, 4 to 12 frames": [
            not one.case.plan.turned and one.case.at_camera_rate for one in found
        ],
        "turned": [plan.turned for plan in plans],
    }
    for name, chosen in groups.items():
        some = [one for one, of in zip(found, chosen, strict=True) if of]
        if any(not one.held for one in some):
            print(row(name, some))


if __name__ == "__main__":
    main()
