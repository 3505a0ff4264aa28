"""Errors of the circle finder on virtual units, and agreement of halves of real presses.

``python -m experiments.circle_finding [--units 20] [--data FOLDER] [KIND ...]`` prints a table.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from experiments.press_sets import SETS, Presses
from experiments.virtual_presses import KINDS, VirtualUnit
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.calibration.press_search import find_presses, light_of, refound, relocate_press
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.targets import undeformed_sensor
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile

_COVERED = 1.515
"""Radius of a circle that holds 68.3 % of a normal distribution of standard deviation 1."""


@dataclass(frozen=True)
class Error:
    """Error of one circle, px."""

    centre_px: float
    radius_px: float
    circle: Circle
    cut: bool


def errors(unit: VirtualUnit) -> list[Error]:
    """Find the circles of a virtual unit; those that are used."""
    found = find_presses(
        [press.frame.source for press in unit.presses],
        [press.frame for press in unit.presses],
        unit.reference,
        [press.ball_px for press in unit.presses],
    )
    return [
        Error(
            float(np.hypot(*np.subtract(press.centre_px, true.centre_px))),
            press.radius_px - true.contact_px,
            press.circle,
            true.cut,
        )
        for press, true in zip(found, unit.presses, strict=True)
        if press.used
    ]


def line(name: str, found: Iterable[Error], count: int) -> str:
    """Row of the table for some circles of ``count`` presses."""
    seen = list(found)
    if not seen:
        return f"| {name} | 0 of {count} |"
    centre = np.array([e.centre_px for e in seen])
    radius = np.array([e.radius_px for e in seen])
    std, radius_std = (
        np.array([getattr(e.circle, key) for e in seen])
        for key in ("centre_std_px", "radius_std_px")
    )
    cells = (
        name,
        f"{len(seen)} of {count}",
        " / ".join(f"{np.quantile(centre, share):.2f}" for share in (0.5, 0.9, 1)),
        f"{np.mean(centre > 1.5):.1%}",
        f"{np.median(radius):+.2f} / {np.quantile(np.abs(radius), 0.9):.2f}",
        coverage(centre / _COVERED, std),
        coverage(np.abs(radius), radius_std),
        f"{spearmanr(centre, std)[0]:.2f} / {spearmanr(np.abs(radius), radius_std)[0]:.2f}",
        f"{np.median(std) / np.sqrt(np.mean(centre**2) / 2):.2f}"
        f" / {np.median(radius_std) / np.sqrt(np.mean(radius**2)):.2f}",
    )
    return f"| {' | '.join(cells)} |"


def coverage(error: np.ndarray, std: np.ndarray) -> str:
    """Share of errors below one standard deviation: all, and the fifths from small to large."""
    below = (error < std)[np.argsort(std)]
    fifths = ", ".join(f"{100 * part.mean():.0f}" for part in np.array_split(below, 5) if len(part))
    return f"{below.mean():.0%} ({fifths})"


def halves(data: Path, chosen: Presses) -> str:
    """Distance of the circles of one half under its own light and under that of the other half."""
    folder, profile = data / chosen.folder, load_profile(chosen.profile)
    files = sorted(folder.glob(chosen.pattern))
    frames = [frame for file in files for frame in read_frames(profile, file)]
    reference, _ = undeformed_sensor(profile, frames, folder / chosen.reference, None)
    condition = Conditioning.for_build(profile, reference, compensates=True)
    assert condition.reference is not None
    ball_px = chosen.ball_mm / 2 / profile.image.mm_per_px
    ready = [condition(frame) for frame in frames]
    presses = find_presses([file.name for file in files], ready, condition.reference, ball_px)
    parts = [[p for p in refound(presses[k::2]) if p.used] for k in (0, 1)]
    apart = [_apart(parts[k], parts[1 - k]) for k in (0, 1)]
    medians = ", ".join(f"{np.median(part):.2f}" for part in apart if part)
    return f"| {chosen.name} | {sum(p.used for p in presses)} of {len(presses)} | {medians} |"


def _apart(presses: list[FoundPress], others: list[FoundPress]) -> list[float]:
    if not others:
        return []
    light = light_of(others)
    again = [relocate_press(press, light) for press in presses]
    pairs = zip(presses, again, strict=True)
    return [float(np.hypot(*np.subtract(a.centre_px, b.centre_px))) for a, b in pairs]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--units", type=int, default=20)
    parser.add_argument("--first", type=int, default=100, help="seed of the first unit")
    parser.add_argument("--data", type=Path, help="also compare halves of these recordings")
    given = parser.parse_args()
    print(
        "| presses | used | centre off, median / 90 % / largest, px | > 1.5 px | radius off, median"
        " / 90 %, px | coverage, centre | coverage, radius | rank correlation, centre / radius |"
        " median std / RMSE, centre / radius |\n|" + 9 * " --- |"
    )
    for kind in given.kinds or KINDS:
        found: list[Error] = []
        cut: list[bool] = []
        for seed in range(given.first, given.first + given.units):
            unit = KINDS[kind](seed)
            found += errors(unit)
            cut += [press.cut for press in unit.presses]
        for at_border in (False, True):
            name = f"{kind}, cut by the border" if at_border else kind
            some = [e for e in found if e.cut == at_border]
            print(line(name, some, cut.count(at_border)), flush=True)
    if given.data is not None:
        print("\n| presses | used | circles of halves apart, median, px |\n| --- | --- | --- |")
        for chosen in SETS:
            print(halves(given.data, chosen), flush=True)


if __name__ == "__main__":
    main()
