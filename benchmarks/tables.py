"""Every published table at once: ``python benchmarks/tables.py --out DIR``, and what has moved.

``python benchmarks/tables.py --out before [--only NAME ...]``
    runs the commands of `TABLES` with this interpreter, and writes what each prints to
    ``before/NAME.txt``; it takes about an hour of one core.
``python benchmarks/tables.py --compare before after``
    prints every number that differs, with its line, and exits with 1 if there is one.

Recordings come from ``shared/data`` in the parent folder of this checkout.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from itertools import zip_longest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ACCURACY = ("six_led_grid", "four_colour_grid", "groove", "four_colour_groove", "hex_fingertip")
ACCURACY += ("gelsight_mini", "bear", "objectfolder", "wedge", "far_heights", "border_virtual")
ACCURACY += ("peak_heights", "markers", "slip_lifts", "slip_gripper", "slip_gripper_fourth")
TABLES = {row: f"benchmarks/accuracy.py --only {row}" for row in ACCURACY} | {
    "slip_recordings": "benchmarks/slip_recordings.py",
    "slip_lift_folds": "benchmarks/slip_lift_folds.py",
    "slip_virtual": "benchmarks/slip_virtual.py --seed 5",
    "marker_tracking": "benchmarks/marker_tracking.py",
    "displacement": "benchmarks/displacement_virtual.py --objects 48 --seed 7",
    "sheared_discs": "-m experiments.sheared_discs --seeds 40 41 42 43 44 45",
    "contact_outline": "-m experiments.contact_outline",
    "elastic_force": "-m experiments.elastic_force --seeds 3 4 5 --random 4",
    "friction": "-m experiments.friction --seeds 2 3",
    "undeformed": "-m experiments.undeformed ../shared/data",
}
"""Name of a table and the command that prints it."""

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def main() -> None:
    """Run the tables, or compare two runs of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", nargs="*", choices=TABLES, default=list(TABLES))
    parser.add_argument("--compare", nargs=2, type=Path, metavar=("BEFORE", "AFTER"))
    asked = parser.parse_args()
    if asked.compare:
        sys.exit(compare(*asked.compare))
    asked.out.mkdir(parents=True, exist_ok=True)
    failed = [name for name in asked.only if not run(name, asked.out)]
    sys.exit(f"failed: {', '.join(failed)}" if failed else 0)


def run(name: str, out: Path) -> bool:
    """Write what the table's command prints; say how long it took."""
    start = time.monotonic()
    ended = subprocess.run(
        [sys.executable, *TABLES[name].split()], cwd=ROOT, capture_output=True, text=True
    )
    (out / f"{name}.txt").write_text(ended.stdout)
    print(f"{name:20} {time.monotonic() - start:6.0f} s  {ended.stderr[-200:]}", flush=True)
    return ended.returncode == 0


def compare(before: Path, after: Path) -> int:
    """Print the lines whose numbers differ; return 1 if there are any."""
    moved = 0
    for name in TABLES:
        old, new = ((folder / f"{name}.txt").read_text().splitlines() for folder in (before, after))
        lines = [pair for pair in zip_longest(old, new, fillvalue="") if pair[0] != pair[1]]
        print(f"{name:20} {len(lines)} of {len(new)} lines moved")
        for earlier, later in lines:
            print(f"  - {earlier}\n  + {later}{largest_change(earlier, later)}")
        moved += len(lines)
    return int(moved > 0)


def largest_change(earlier: str, later: str) -> str:
    """Return the largest relative change of the numbers of two lines of one form, in words."""
    numbers = [[float(found) for found in NUMBER.findall(line)] for line in (earlier, later)]
    if len(numbers[0]) != len(numbers[1]) or not numbers[0]:
        return "   (another form)"
    largest = max(abs(b - a) / max(abs(a), 1e-9) for a, b in zip(*numbers, strict=True))
    return f"   ({largest:.1%})"


if __name__ == "__main__":
    main()
