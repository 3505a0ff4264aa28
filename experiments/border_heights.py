"""Heights at the image border and far from a contact: ``python experiments/border_heights.py``.

Virtual: units like a GelSight Mini whose light falls off steeply, each calibrated by ball presses
with the defaults, and presses whose contact the image border cuts. Real: recorded ball presses,
half of them measured with a calibration on the other half. Far from the contact means beyond three
contact radii. There the error of a virtual height is known, and a recorded one is 0 apart from the
bulge of the gel, which counts as an error.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.press_sets import SETS, Presses
from experiments.presses import calibrated
from experiments.table_row import Row, command
from experiments.virtual_unit import Pressed, VirtualUnit
from tactile_core.calibration.press_search import find_presses, light_of, relocate_press
from tactile_core.calibration.presses import FoundPress
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.quantities import HeightMap

RIG = "hex_fingertip_unmarked"
FAR_RADII = 3.0
REAL = ("gelsight_mini", "objectfolder", "wedge")


@dataclass(frozen=True)
class Far:
    """Errors of the height of one press, relative to its depth.

    Attributes
    ----------
    rms, p95, largest : float
        Size of the error beyond three contact radii.
    inside : float
        RMS error within the contact; NaN without a truth.
    """

    label: str
    rms: float
    p95: float
    largest: float
    inside: float = float("nan")


def far_of(
    label: str,
    height_mm: NDArray[Any],
    far: NDArray[np.bool_],
    true_mm: NDArray[Any] | float = 0.0,
    inside: float = float("nan"),
) -> Far:
    """Score the pixels ``far`` from a contact."""
    sizes = np.abs(height_mm - true_mm)[far] / height_mm.max()
    return Far(
        label,
        float(np.sqrt(np.mean(sizes**2))),
        float(np.percentile(sizes, 95)),
        float(sizes.max()),
        inside,
    )


def steep_light(seed: int) -> dict[str, Any]:
    """Unit with the view of a GelSight Mini and lights so near that they fall off steeply."""
    rng = np.random.default_rng([17, seed])
    return {
        "image": {"width_px": 320, "height_px": 240, "mm_per_px": 0.0634},
        "gel": {"thickness_mm": float(rng.uniform(1.5, 4)), "size_mm": [26, 21]},
        "optics": {
            "lights": {
                "distance_mm": float(rng.uniform(10.5, 14)),
                "lobe_deg": float(rng.uniform(60, 120)),
                "aim_mm": float(rng.uniform(-4, 4)),
                "scatter": float(rng.uniform(0, 0.3)),
                "spread": 0.3,
            },
            "ambient": float(rng.uniform(0.05, 0.25)),
            "sensor": {"exposure": float(rng.uniform(0.25, 0.4)), "vignetting": 0.3},
        },
    }


def cut_contacts(rng: np.random.Generator) -> Iterator[Pressed]:
    """Presses whose contact the border cuts or touches, and one in the interior."""
    near, side, other = rng.uniform(0.42, 0.48, 3), rng.choice([-1, 1], 2), rng.uniform(-0.3, 0.3)
    ball: dict[str, Any] = {"kind": "sphere", "sizes": {"diameter_mm": 1.0}, "depth": 0.15}
    yield Pressed("left or right", x=side[0] * near[0], y=other, **ball)
    yield Pressed("top or bottom", x=other, y=side[1] * near[1], **ball)
    yield Pressed("corner", x=side[0] * near[2], y=side[1] * near[2], **ball)
    yield Pressed("interior", x=other, y=other / 2, **ball)


def on_virtual(seed: int) -> Iterator[Far]:
    """Measure the contacts on one unit; the first is the undeformed gel, in mm."""
    unit = VirtualUnit(RIG, seed, steep_light(seed))
    reference = unit.measured(None)
    assert reference is not None
    largest_mm = float(np.abs(reference[0].mm).max())
    yield Far("undeformed, mm", largest_mm, largest_mm, largest_mm)
    for pressed in cut_contacts(np.random.default_rng([13, seed])):
        found = unit.measured(pressed)
        if found is None:
            continue
        height, truth = found
        contact = truth.contact
        rows, columns = np.nonzero(contact)
        radius_px = max(np.ptp(rows), np.ptp(columns)) / 2
        apart = cv2.distanceTransform((~contact).view(np.uint8), cv2.DIST_L2, 5)
        error = (height.mm - truth.height_mm)[contact] / truth.height_mm.max()
        inside = float(np.sqrt(np.mean(error**2)))
        far = apart > (FAR_RADII - 1) * radius_px
        yield far_of(pressed.label, height.mm, far, truth.height_mm, inside)


def on_recordings(data: Path, chosen: Presses) -> Iterator[Far]:
    """Measure each half of the presses, and the reference, with a calibration on the other half."""
    folder = data / chosen.folder
    files = sorted(folder.glob(chosen.pattern))
    for seen, unseen in ((files[::2], files[1::2]), (files[1::2], files[::2])):
        made = calibrated(folder, chosen, seen, None, scored=False)
        pipeline = Pipeline(chosen.profile, made.bundle)
        train = [press for press in made.presses if isinstance(press, FoundPress) and press.used]
        light, ball_px = light_of(train), train[0].ball_radius_px
        (frame,) = read_frames(pipeline.profile, folder / chosen.reference)
        largest_mm = float(np.abs(pipeline.process(frame)[HeightMap].mm).max())
        yield Far("undeformed, mm", largest_mm, largest_mm, largest_mm)
        for file in unseen:
            (frame,) = read_frames(pipeline.profile, file)
            reading = pipeline.process(frame)
            found = find_presses([file.name], [reading.frame], made.bundle.reference, ball_px)
            press = relocate_press(found[0], light)
            far = ~press.disc(FAR_RADII * press.radius_px)
            yield far_of(file.name, reading[HeightMap].mm, far)


def row_of(name: str, figure: str, recordings: str, found: list[Far]) -> Row:
    """Row of the table; the figure is the mean over presses of the 95th percentile."""
    presses = [each for each in found if not each.label.startswith("undeformed")]
    at_rest = [each for each in found if each.label.startswith("undeformed")]
    also = {
        "RMS": float(np.mean([each.rms for each in presses])),
        "95th percentile of the worst press": max(each.p95 for each in presses),
        "largest height of the undeformed gel, mm": max(each.largest for each in at_rest),
    }
    values = {"95th percentile": float(np.mean([each.p95 for each in presses]))}
    inside = {each.label: [e.inside for e in presses if e.label == each.label] for each in presses}
    if np.isfinite(presses[0].inside):
        also |= {f"RMS in contact, {label}": float(np.mean(e)) for label, e in inside.items()}
    return Row(
        name,
        figure,
        recordings,
        f"{len(presses)} presses",
        "out of sample: other presses than those of the calibration",
        values,
        max(values.values()),
        {"predict flat": 0.0, "predict flat, in contact": 1.0},
        command(name),
        also,
    )


FIGURE = "error of the height beyond three contact radii over the depth of the contact"


def virtual_rows(data: Path, units: int = 20) -> list[Row]:
    """Contacts at the border of virtual units; ``data`` is not used."""
    found = [far for seed in range(units) for far in on_virtual(seed)]
    what = f"{units} virtual units, 320 × 240, steep fall-off of the light; ball at the border"
    return [row_of("border_virtual", FIGURE, what, found)]


def real_rows(data: Path) -> list[Row]:
    """Recorded presses of a ball."""
    chosen = [each for each in SETS if each.name in REAL]
    return [
        row_of("far_heights", FIGURE, each.folder, list(on_recordings(data, each)))
        for each in chosen
    ]


def main() -> None:
    """Print one line for each virtual unit and press, or each recording."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", nargs="?", type=Path, help="folder of recordings")
    parser.add_argument("--units", type=int, default=20)
    options = parser.parse_args()
    if options.data is None:
        sources = {f"unit {seed}": on_virtual(seed) for seed in range(options.units)}
    else:
        sources = {s.name: on_recordings(options.data, s) for s in SETS if s.name in REAL}
    for name, source in sources.items():
        for far in source:
            print(
                f"{name:16}{far.label:16}RMS {far.rms:.3f}  p95 {far.p95:.3f}  largest "
                f"{far.largest:.3f}  in contact {far.inside:.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
