"""Accuracy on real recordings: ``python benchmarks/accuracy.py [DATA] [--only ROW] [--json FILE]``.

Prints one table of all figures: the recording, both directions of a split and the worse of them,
and the score of a trivial baseline. ``--model`` replaces the profiles' calibrator for ball presses.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

from experiments import (
    border_heights,
    given_lights,
    grids,
    groove,
    marker_rows,
    peak_heights,
    presses,
    slip_rows,
)
from experiments.press_sets import SETS
from experiments.slip_trials import FOURTH
from experiments.table_row import HEADER, Row

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"

Measure = Callable[[Path], list[Row]]


def main() -> None:
    """Print the table, each row as soon as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=DATA)
    parser.add_argument("--model", help="PLUGIN.NAME of a calibration, for presses of a ball")
    known = measures(None)
    parser.add_argument("--only", choices=known, action="append", metavar="ROW")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    chosen = options.only or list(known)
    print(HEADER, flush=True)
    done: list[Row] = []
    for name, measure in measures(options.model).items():
        if name in chosen:
            for row in measure(options.data):
                print(row.line(), flush=True)
                done.append(row)
    if options.json:
        summary = [row.summary() for row in done]
        options.json.write_text(json.dumps(summary, indent=1, ensure_ascii=False) + "\n")


def measures(model: str | None) -> dict[str, Measure]:
    """Measurements by name."""
    known: dict[str, Measure] = {
        each.name: partial(grids.rows, grids=each) for each in (grids.SIX, grids.FOUR)
    }
    known |= {"groove": groove.rows, "four_colour_groove": groove.four_colour_rows}
    known["bear"] = given_lights.rows
    known |= {s.name: partial(presses.rows, chosen=s, model=model) for s in SETS}
    known |= {
        "peak_heights": peak_heights.rows,
        "border_virtual": border_heights.virtual_rows,
        "far_heights": border_heights.real_rows,
        "markers": marker_rows.rows,
        "slip_lifts": slip_rows.lifts,
        "slip_gripper": slip_rows.gripper,
        "slip_gripper_fourth": partial(slip_rows.gripper, every=FOURTH),
    }
    return known


if __name__ == "__main__":
    main()
