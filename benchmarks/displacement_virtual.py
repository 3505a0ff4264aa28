"""Dense displacement on rendered frames: ``python benchmarks/displacement_virtual.py``.

Presses unseen virtual objects on ``hex_fingertip``, whose markers are 1.1 mm apart, and shears or
twists them. Compares the displacement field of the profile's whole chain with the ground truth at
every pixel: RMS error over the image in % of the largest true displacement. There are three
variants: with the true contact area, with that of a calibrated ``core.contact``, and with none.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from slip_virtual import PROFILE, UNIT, calibrated, drawn, undeformed

from experiments.slip_sequences import Plan
from tactile_core import Pipeline
from tactile_core.algorithms.displacement.marked_surface import MarkedSurface
from tactile_core.bundles.bundle import Bundle
from tactile_core.quantities import ContactMask, DisplacementField, Frame, MarkerField
from tactile_sim import VirtualStage
from tactile_sim.truth import TrueState

LOOKS, STEPS = 4, 6
"""Frames to compare, and moves before each (counts)."""

WAYS = ("true contact", "core.contact", "no contact")


class Row(NamedTuple):
    """One frame: errors in % in the order of :data:`WAYS`, and accuracy of the contact area."""

    kind: str
    percent: tuple[float, ...]
    overlap: float
    area: float


def frames(plan: Plan) -> Iterator[tuple[Frame, TrueState]]:
    """Take a frame of the undeformed surface, then frames while the object shears or twists it."""
    stage = VirtualStage(PROFILE, UNIT, overrides={"gel": {"friction": plan.friction}})
    yield stage.frame(), stage.truth()
    x, y = plan.place_mm
    stage.indenter(plan.shape, x_mm=x, y_mm=y, angle_deg=plan.angle_deg, **plan.options)
    stage.press(depth_mm=plan.depth_mm)
    along, down = np.cos(plan.direction_rad), np.sin(plan.direction_rad)
    for _ in range(LOOKS):
        for _ in range(STEPS):
            if plan.turned:
                stage.twist(plan.step)
            else:
                stage.shear(plan.step * along, plan.step * down)
        yield stage.frame(), stage.truth()


def percent(measured_mm: NDArray[np.float32], truth: TrueState) -> float:
    """RMS error over the image, in % of the largest true displacement."""
    true_mm = truth.displacement_mm
    error_mm = np.linalg.norm(measured_mm - true_mm, axis=-1)
    return float(100 * np.sqrt(np.mean(error_mm**2)) / np.linalg.norm(true_mm, axis=-1).max())


def measured(plan: Plan, bundle: Path) -> list[Row]:
    """Measure one object's frames."""
    taken = frames(plan)
    reference = undeformed(next(taken)[0])
    seeing, blind = (Pipeline(PROFILE, made, reference) for made in (Bundle.load(bundle), None))
    gel = seeing.profile.gel
    rows = []
    for frame, truth in taken:
        full, plain = seeing.process(frame), blind.process(frame)
        markers, seen = full[MarkerField], full[ContactMask].mask
        surface = MarkedSurface(
            markers.reference_px,
            truth.contact.shape,
            mm_per_px=markers.mm_per_px,
            thickness_mm=gel.thickness_mm or 2.0,
            poisson_ratio=gel.poisson_ratio or 0.48,
        )
        fields = (
            surface.displacement(markers.px, markers.seen, truth.contact),
            full[DisplacementField].mm,
            plain[DisplacementField].mm,
        )
        both, either = (seen & truth.contact).sum(), (seen | truth.contact).sum()
        rows.append(
            Row(
                plan.kind,
                tuple(percent(field, truth) for field in fields),
                float(both / max(either, 1)),
                float(seen.sum() / truth.contact.sum()),
            )
        )
    return rows


def report(rows: list[Row]) -> None:
    """Print a table: median, 90th percentile, maximum."""
    print(f"{len(rows)} frames; RMS in % of the peak: median / 90th percentile / maximum")
    print(f"{'':12}" + "".join(f"{way:>20}" for way in WAYS) + "   contact: IoU, area")
    for kind in ("all", *dict.fromkeys(row.kind for row in rows)):
        some = [row for row in rows if kind in ("all", row.kind)]
        errors = np.array([row.percent for row in some])
        spread = np.stack([np.median(errors, 0), np.quantile(errors, 0.9, 0), errors.max(0)])
        cells = "".join(f"{low:8.1f} /{high:4.1f} /{most:4.1f}" for low, high, most in spread.T)
        overlap, area = (np.median([getattr(r, n) for r in some]) for n in ("overlap", "area"))
        print(f"{kind:12}{cells}   {overlap:12.2f}, {area:.2f}")


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objects", type=int, default=24)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    with TemporaryDirectory(prefix="displacement-virtual-") as name:
        bundle = calibrated(Path(name))
        with ProcessPoolExecutor(given.processes) as pool:
            found = pool.map(partial(measured, bundle=bundle), drawn(given.objects, given.seed))
            report([row for rows in found for row in rows])


if __name__ == "__main__":
    main()
