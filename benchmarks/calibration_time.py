"""Time of a calibration: ``python benchmarks/calibration_time.py [--presses 25] [--size 320x240]``.

Renders presses of a ball on a virtual unit, and runs ``tactile calibrate`` on them in this process
and its helpers. Prints the processor time of all and the elapsed time, without loading the code
that rendering has loaded before, and the held-out error. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from virtual_calibration import Draw, command, simulated

from tactile_core.formats.npz import read_npz
from tactile_core.profiles.loader import load_profile


def main() -> None:
    """Print one line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--profile", default="hex_fingertip_unmarked")
    parser.add_argument("--presses", type=int, default=25)
    parser.add_argument("--size", default="320x240", metavar="WxH")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    image = load_profile(options.profile).image
    mm_per_px = image.mm_per_px * image.width_px / width
    with TemporaryDirectory(prefix="calibration-time-") as name:
        folder = Path(name)
        sized = folder / "sized.yaml"
        size = {"width_px": width, "height_px": height, "mm_per_px": mm_per_px}
        keys = {"extends": options.profile, "name": "sized", "image": size}
        sized.write_text(json.dumps(keys))
        draw = Draw(load_profile(sized), options.seed)
        taken = folder / "taken"
        simulated(str(sized), draw.calibrating(options.presses), taken, options.seed)
        _keep_presses(taken)
        started, used = perf_counter(), _processor_time()
        printed = command(
            *("calibrate", str(sized), "--presses", str(taken / "frames")),
            *("--reference", str(taken / "reference")),
            *("--ball-diameter-mm", str(draw.ball_mm), "--out", str(folder / "out"), "--json"),
        )
        used, elapsed = _processor_time() - used, perf_counter() - started
    report = json.loads(printed)
    error_deg = report["held_out"]["normal_error_deg"]["mean"]
    print(
        f"{len(report['presses'])} presses, {options.size}: {used:.1f} s of processor time, "
        f"{elapsed:.1f} s elapsed; held-out error {error_deg:.3f}°"
    )


def _processor_time() -> float:
    """Processor time of this process and of helpers that have ended, s."""
    return sum(os.times()[:4])


def _keep_presses(taken: Path) -> None:
    """Remove the frames of the released gel between the presses."""
    for truth in (taken / "truth").glob("*.npz"):
        if not read_npz(truth)["contact"].any():
            for frame in (taken / "frames").glob(f"{truth.stem}.*"):
                frame.unlink()


if __name__ == "__main__":
    main()
