"""Choose the thresholds of ``core.slip`` on virtual sequences, and score them on unseen ones.

    python benchmarks/slip_thresholds.py            # some minutes on two cores
    python benchmarks/slip_thresholds.py --quick    # a tenth of the sequences
    python benchmarks/slip_thresholds.py --seed 9   # other sequences, with the shipped thresholds

The first line of the output gives the defaults of ``tactile_core.builtin.slip.Slip.Options``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.slip_sequences import GROSS, HALF, Judged, judged, plans
from tactile_core.algorithms.slip.state import SlipMachine, Thresholds
from tactile_core.builtin.slip import Slip

Array = NDArray[np.float64]

TRAINING, UNSEEN = 1, 2
"""Seeds. Nothing is chosen on the second, but ``slip_virtual.py`` was debugged on it."""

TRAINED, JUDGED = (42, 24), (36, 18)
"""Numbers of sequences with shear and with twist."""

FALSE_ALARMS = 0.015
"""Share of the frames with at least half stick that may raise an alarm. Chosen by hand."""
QUICK_MM_S = 0.3
"""Above this speed, gross slip continues to shear the gel, whose friction doubles at 0.4 mm/s."""


@dataclass(frozen=True)
class Score:
    """Accuracy of slip detection on some sequences; NaN where it is undefined."""

    sequences: int
    incipient_auc: float
    gross_auc: float
    false_alarms: float
    warned: float

    def __str__(self) -> str:
        return (
            f"{self.sequences:4d} {self.incipient_auc:9.4f} {self.gross_auc:9.4f} "
            f"{100 * self.false_alarms:7.1f} % {100 * self.warned:6.1f} %"
        )


def auc(score: Array, truth: NDArray[np.bool_]) -> float:
    """Area under the ROC curve: probability that a positive scores above a negative."""
    from scipy.stats import rankdata

    positive, negative = int(truth.sum()), int((~truth).sum())
    if not positive or not negative:
        return float("nan")
    ranks = rankdata(score)[truth].sum()
    return float((ranks - positive * (positive + 1) / 2) / (positive * negative))


def choose(sequences: Sequence[Judged]) -> Thresholds:
    """Choose thresholds.

    Incipient slip starts at the degree that gives the allowed share of false alarms, gross slip at
    the degree that separates it best. Both end lower by the 95th percentile of the change of degree
    between frames of a sticking contact (hysteresis).
    """
    degree = np.concatenate([one.degree for one in sequences])
    stick = np.concatenate([one.stick_share for one in sequences])
    sticks = [np.abs(np.diff(one.degree))[one.stick_share[1:] >= HALF] for one in sequences]
    jump = float(np.quantile(np.concatenate(sticks), 0.95))
    incipient = float(np.quantile(degree[stick >= HALF], 1 - FALSE_ALARMS))
    gross = stick < GROSS
    tried = np.linspace(incipient, 1, 101)
    right = [(degree[gross] >= t).mean() + (degree[~gross] < t).mean() for t in tried]
    slip = float(tried[int(np.argmax(right))])
    return Thresholds(
        incipient=round(incipient, 2),
        incipient_ends=round(incipient - jump, 2),
        slip=round(slip, 2),
        slip_ends=round(max(slip - jump, incipient - jump), 2),
    )


def score(sequences: Sequence[Judged], thresholds: Thresholds) -> Score:
    """Score the degree, and the alarms that these thresholds raise."""
    degree = np.concatenate([one.degree for one in sequences])
    stick = np.concatenate([one.stick_share for one in sequences])
    false, sticking, warned = 0, 0, []
    for one in sequences:
        alarm = _alarm(one, thresholds)
        held = one.stick_share >= HALF
        false, sticking = false + int((alarm & held).sum()), sticking + int(held.sum())
        gross = np.flatnonzero(one.stick_share < GROSS)
        if len(gross) and gross[0] > 0:
            warned.append(bool(alarm[: gross[0]].any()))
    return Score(
        len(sequences),
        auc(degree, stick < HALF),
        auc(degree, stick < GROSS),
        false / max(sticking, 1),
        float(np.mean(warned)) if warned else float("nan"),
    )


def _alarm(one: Judged, thresholds: Thresholds) -> NDArray[np.bool_]:
    machine, alarm = SlipMachine(thresholds), []
    for degree in one.degree:
        machine.update(float(degree), "translation", 0.0)
        alarm.append(machine.name in ("incipient", "slip"))
    return np.array(alarm)


def shipped() -> Thresholds:
    """Return the thresholds of ``core.slip``."""
    options = Slip.Options()
    return Thresholds(
        incipient=options.incipient,
        incipient_ends=options.incipient_ends,
        slip=options.slip,
        slip_ends=options.slip_ends,
    )


def run(seed: int, share: float = 1.0, processes: int = 2) -> list[Judged]:
    """Simulate and score the sequences of a seed."""
    counts = TRAINED if seed == TRAINING else JUDGED
    sheared, turned = (max(6, round(share * count)) for count in counts)
    wanted = plans(sheared, seed, turned=False) + plans(turned, seed, turned=True)
    with ProcessPoolExecutor(processes) as pool:
        return list(pool.map(judged, wanted))


def _quick(one: Judged) -> bool:
    return (one.plan.speed_mm_s or 0) >= QUICK_MM_S


def _quasi_static(one: Judged) -> bool:
    return one.plan.speed_mm_s is None


GROUPS: dict[str, Callable[[Judged], bool]] = {
    "all": lambda one: True,
    "not above 0.3 mm/s": lambda one: not _quick(one),
    "sheared": lambda one: not one.plan.turned,
    "sheared, border in view": lambda one: not one.plan.turned and one.plan.kind != "plate",
    "twisted": lambda one: one.plan.turned,
    "sheared, quasi-static": lambda one: not one.plan.turned and _quasi_static(one),
    "sheared, to 0.3 mm/s": lambda one: (
        not one.plan.turned and not _quasi_static(one) and not _quick(one)
    ),
    "sheared, 0.3 to 1 mm/s": lambda one: not one.plan.turned and _quick(one),
    "twisted, quasi-static": lambda one: one.plan.turned and _quasi_static(one),
    "twisted, to 0.3 mm/s": lambda one: (
        one.plan.turned and not _quasi_static(one) and not _quick(one)
    ),
    "twisted, 0.3 to 1 mm/s": lambda one: one.plan.turned and _quick(one),
    **{
        kind: (lambda one, kind=kind: one.plan.kind == kind)
        for kind in ("sphere", "cylinder", "rectangle", "disc", "plate")
    },
}


def report(sequences: Sequence[Judged], thresholds: Thresholds) -> None:
    """Print a table."""
    print(f"{'':24} seq incipient     gross   false alarms  warned")
    for name, chosen in GROUPS.items():
        some = [one for one in sequences if chosen(one)]
        if some:
            print(f"{name:23} {score(some, thresholds)}")
    turned = [one for one in sequences if one.plan.turned]
    kinds = [
        state.kind == "rotation"
        for one in turned
        for state in one.states
        if state.state in ("incipient", "slip")
    ]
    print(
        f"slip of twisted objects classified as rotation in {100 * np.mean(kinds):.1f} % of frames"
    )


def main() -> None:
    """Choose and score thresholds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the sequences")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--seed", type=int, help="score the shipped thresholds on other sequences")
    given = parser.parse_args()
    share = 0.1 if given.quick else 1.0
    chosen = shipped() if given.seed else choose(run(TRAINING, share, given.processes))
    print(chosen)
    report(run(given.seed or UNSEEN, share, given.processes), chosen)


if __name__ == "__main__":
    main()
