"""Slip at speed and of plates wider than the view, and the standard deviation of the degree.

    python benchmarks/slip_speed.py                     # seeds 3000 to 3047, about 10 minutes
    python benchmarks/slip_speed.py --seeds 0 72 --fit  # constants of ``slipped_share.py``

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
from tactile_core.algorithms.slip.cues import SLIPPED_SHARE

SEEDS = 3000, 3048
"""Not used for any constant."""
FIFTHS = 5


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


def std_row(some: Sequence[Passage]) -> str:
    """Score the standard deviation of the degree against the true slipped share."""
    from scipy.stats import spearmanr

    states = [state for one in some for state in one.states]
    true = 1 - np.concatenate([one.stick_share for one in some])
    known = np.array([state.degree_std is not None for state in states])
    std = np.array([state.degree_std or 0.0 for state in states])[known]
    error = np.abs(np.array([state.degree for state in states]) - true)[known]
    fifths = np.array_split(np.argsort(std, kind="stable"), FIFTHS)
    coverage = ", ".join(f"{100 * (error[of] <= std[of]).mean():.0f}" for of in fifths)
    rms = float(np.sqrt(np.mean(error**2)))
    return (
        f"{known.sum()} of {known.size} frames: coverage by fifths {coverage} %, rank correlation "
        f"{spearmanr(std, error)[0]:.2f}, median {np.median(std):.3f}, RMSE {rms:.3f}"
    )


def fit(some: Sequence[Passage]) -> None:
    """Print the constants of the slipped share for contacts that shift and that turn."""
    from scipy.optimize import minimize

    use = SLIPPED_SHARE
    shears = [shear for one in some for shear in one.shears]
    true = 1 - np.concatenate([one.stick_share for one in some])
    degree = np.array([shear.degree for shear in shears])
    turned = np.array([shear.kind == "rotation" for shear in shears])
    slowing = np.array([shear.deceleration >= use.slowing for shear in shears])
    knots, error = np.array(use.knots), np.abs(degree - true)
    classes = np.digitize(degree, (knots[1:] + knots[:-1]) / 2)
    for which, scale, shape in (
        (~turned, use.scale, use.shape),
        (turned, use.turned_scale, use.turned_shape),
    ):
        evidence = scale * (-np.log1p(-np.minimum(degree[which], 1 - 1e-16))) ** (1 / shape)
        best = minimize(_loss, (scale, shape), (evidence, true[which]), method="Nelder-Mead").x
        print("scale, shape", np.round(best, 3))
    for name, which in (
        ("std", ~turned & ~slowing),
        ("slowing_std", ~turned & slowing),
        ("turned_std", turned),
    ):
        inside = [error[which & (classes == knot)] for knot in range(len(knots))]
        print(name, [round(float(np.quantile(e, 0.68)), 3) if e.size else None for e in inside])


def _share(constants: np.ndarray, evidence: np.ndarray) -> np.ndarray:
    scale, shape = np.abs(constants)
    return np.asarray(-np.expm1(-((evidence / scale) ** shape)))


def _loss(constants: np.ndarray, evidence: np.ndarray, true: np.ndarray) -> float:
    return float(np.mean((_share(constants, evidence) - true) ** 2))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=int, nargs=2, default=SEEDS, metavar=("FIRST", "END"))
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--fit", action="store_true")
    given = parser.parse_args()
    with ProcessPoolExecutor(given.processes) as pool:
        found = [one for some in pool.map(passages, range(*given.seeds)) for one in some]
    if given.fit:
        fit(found)
        return
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
    print(std_row(found))


if __name__ == "__main__":
    main()
