"""Every calibration of every recorded sensor on the same presses of a ball.

``python -m experiments.sensor_calibrations [DATA]``. Half of the presses of a sensor are measured
by calibrations that have not seen them: the starting calibration of its design, from virtual
units alone; ours on 3, 5, 10 and all presses of the other half; and those of other programs, where
there are any. Then the halves change places. Circles are found once, for all calibrations.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.press_sets import ROOT
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.imported import import_calibration
from tactile_core.cli.output import table_lines
from tactile_core.evaluation.comparison.ball_presses import (
    BallComparison,
    BallScore,
    compare_on_presses,
)
from tactile_imports.polynomial_table import write_table
from tactile_imports.table_of_bundle import table_of
from tactile_sim.starting_calibration import starting_calibration

COUNTS = (3, 5, 10)
STARTING, OURS = "starting calibration of the design", "ours, "


@dataclass(frozen=True)
class Recorded:
    """Presses of one ball on one sensor, and files of other programs that measure it.

    Several images of one slow press stay together; else every other press is in the other half.
    """

    name: str
    profile: str
    folder: str
    pattern: str
    reference: str
    ball_mm: float
    imports: tuple[tuple[str, str, str], ...] = ()
    slow: bool = False


SENSORS = (
    Recorded(
        "GelSight Mini",
        "gelsight_mini",
        "gelsight_mini/ball_presses",
        "press_*.png",
        "background.png",
        6.31,
        (
            ("gelslam's network of this unit", "gelslam_mini_nnmodel.pth", "imports.gs_sdk"),
            ("Taxim's table of another unit", "taxim_mini_polycalib.npz", "imports.taxim"),
        ),
    ),
    Recorded(
        "DIGIT", "digit", "digit/ball_presses", "[0-9]*.png", "background.png", 4.7, slow=True
    ),
    Recorded(
        "GelSight Wedge",
        "gelsight_wedge_portrait",
        "three_colour/wedge",
        "ball-*.jpg",
        "bg-0.jpg",
        4.84,
    ),
    Recorded(
        "GelSight Wedge, again",
        "gelsight_wedge_portrait",
        "three_colour/wedge_2",
        "presses/*.jpg",
        "background.jpg",
        4.84,
    ),
)


def main() -> None:
    """Print a table of each sensor."""
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data"
    for recorded in SENSORS:
        ways = [*_both_ways(recorded, data)]
        print(f"\n{recorded.name}: {ways[0].used} and {ways[1].used} presses")
        header = [
            *("calibration", "contact", "normals", "sphere / ball", "depth / theory"),
            *("depth within 25 % of ours", "time, ms"),
        ]
        both = [*zip(*(way.scores for way in ways), strict=True)]
        ours = [two for two in both if _name(two[0]).startswith(OURS)][-1]
        rows = [_row(two, ours) for two in both]
        print("\n".join(table_lines(header, rows)), flush=True)


def _both_ways(recorded: Recorded, data: Path) -> Iterator[BallComparison]:
    folder = data / recorded.folder
    files = sorted(folder.glob(recorded.pattern))
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        starting_calibration(recorded.profile).save(here / "starting")
        middle = len(files) // 2
        halves = (files[:middle], files[middle:]) if recorded.slow else (files[::2], files[1::2])
        for way, (seen, unseen) in enumerate((halves, halves[::-1])):
            bundles = _calibrations(recorded, data, seen, here / f"{way}")
            found = compare_on_presses(
                recorded.profile,
                presses=_copied(unseen, here / f"unseen{way}"),
                reference=folder / recorded.reference,
                ball_diameter_mm=recorded.ball_mm,
                bundle=here / "starting",
                swaps=[("calibration", str(place)) for place in bundles.values()],
            )
            yield found


def _calibrations(
    recorded: Recorded, data: Path, seen: Sequence[Path], here: Path
) -> dict[str, Path]:
    reference = data / recorded.folder / recorded.reference
    bundles = {}
    for count in (*(n for n in COUNTS if n < len(seen)), len(seen)):
        step = len(seen) / count
        some = [seen[int(step * k)] for k in range(count)]
        made = calibrate(
            recorded.profile,
            _copied(some, here / f"presses{count}"),
            reference,
            ball_diameter_mm=recorded.ball_mm,
            scored=False,
        )
        bundles[f"{OURS}{count} presses"] = here / f"{OURS}{count} presses"
        made.bundle.save(bundles[f"{OURS}{count} presses"])
    if recorded.imports:
        exported = here / "polycalib.npz"
        write_table(exported, table_of(made.bundle), "bgr")
        files = [(n, data / "calibrations" / f, kind) for n, f, kind in recorded.imports]
        for name, file, kind in (*files, ("ours as Taxim's table", exported, "imports.taxim")):
            bundles[name] = here / name.replace("'", "")
            import_calibration(file, kind, recorded.profile).save(bundles[name])
    return bundles


def _copied(files: Sequence[Path], folder: Path) -> Path:
    folder.mkdir(parents=True)
    for file in files:
        shutil.copy(file, folder)
    return folder


def _name(score: BallScore) -> str:
    name = Path(score.variant.name.removeprefix("calibration=")).name
    return STARTING if name == "as it is" else name


def _row(both: Sequence[BallScore], ours: Sequence[BallScore]) -> list[str]:
    """Return the name, and the results of both ways: the worse one of normals and time.

    Depth by theory depends on the contact's radius, which is uncertain, so it is also compared with
    that by our calibration on most presses.
    """
    results = [score.summary() for score in both]
    found = np.concatenate([score.contacts for score in both])
    depths, by_ours = (np.concatenate([s.depth_ratios for s in two]) for two in (both, ours))
    degrees = max(one["normal_error_deg"]["mean"] for one in results)
    ratios = (
        "; ".join(f"{one[key]['median']:.3f}" for one in results)
        for key in ("sphere_radius_ratio", "depth_ratio")
    )
    time_ms = max(one["latency_ms"]["median"] for one in results)
    return [
        _name(both[0]),
        f"{found.mean():.0%}",
        f"{degrees:.2f}°",
        *ratios,
        f"{np.mean(np.abs(depths / by_ours - 1) < 0.25):.0%}",
        f"{time_ms:.1f}",
    ]


if __name__ == "__main__":
    main()
