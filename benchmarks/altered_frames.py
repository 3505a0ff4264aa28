"""Frames that do not show the gel of the reference: ``python benchmarks/altered_frames.py [DATA]``.

Frames of recorded and of virtual sensors, undeformed and in contact, are altered as the camera's
images would be. Those that change the height by more than 0.05 mm anywhere, or the contact by more
than 5 %, should be warned of, each with its cause; no frame of the unit itself should.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from experiments.press_sets import HERE, SETS, Presses
from tactile_core import ContactMask, HeightMap, Pipeline, ShownGel, load_profile
from tactile_core.algorithms.arrays.types import Array
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import TactileError
from tactile_core.formats.images import read_image
from tactile_core.interfaces.sink import Reading
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame
from tactile_sim import VirtualStage
from tactile_sim.simulation import write_frame
from tactile_sim.stage import vary

RIGS = (
    "hex_fingertip",
    "hex_fingertip_unmarked",
    "baxter_fingertip",
    "desktop_three_colour",
    "desktop_six_led_portable",
)
RECORDED = (
    *SETS[:3],
    Presses(
        "wedge_2",
        SETS[1].profile,
        "three_colour/wedge_2",
        "presses/*",
        "background.jpg",
        4.84,
        "another calibration of the same sensor",
    ),
    Presses(
        "digit",
        HERE / "digit.yaml",
        "digit/ball_presses",
        "0*.png",
        "background.png",
        4.7,
        "three simultaneous colours, no markers",
    ),
)
LEAST_HEIGHT_MM, LEAST_AREA = 0.05, 0.05
ESTIMATORS = {"height": {"use": "core.poisson"}, "contact": {"use": "core.contact"}}


@dataclass(frozen=True)
class Unit:
    """A calibrated unit and images of it.

    Attributes
    ----------
    frame : callable
        Makes a frame of an image (H, W, K).
    """

    name: str
    pipeline: Pipeline
    images: dict[str, Array]
    frame: Callable[[Array], Frame]


class Alteration(NamedTuple):
    kind: str
    name: str
    of: Callable[[Array], Array]


def alterations(channels: int) -> Iterator[Alteration]:
    """Yield every alteration of an image with this number of channels."""
    if channels == 3:
        for order in ([2, 1, 0], [1, 0, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1]):
            yield Alteration("channels_swapped", str(order), lambda p, o=order: p[..., o])
        yield Alteration("grey", "grey", _grey)
    yield Alteration("turned", "180°", lambda p: p[::-1, ::-1])
    yield Alteration("mirrored", "left to right", lambda p: p[:, ::-1])
    yield Alteration("mirrored", "top to bottom", lambda p: p[::-1])
    for rows in (8, 16, 48, 96):
        for axis in (0, 1):
            yield Alteration("rolled", f"{rows}", lambda p, n=rows, a=axis: np.roll(p, n, a))
    for share in (0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95):
        for place in ((0.5, 0.5), (0.0, 1.0)):
            yield Alteration("cropped", f"{share}", lambda p, s=share, at=place: _crop(p, s, at))
    for share in (0.04, 0.06, 0.08, 0.12, 0.2):
        for axis in (0, 1):
            yield Alteration(
                "one_sided_light", f"{share}", lambda p, s=share, a=axis: _ramp(p, s, a)
            )


def _grey(pixels: Array) -> Array:
    return np.repeat(
        cv2.cvtColor(np.ascontiguousarray(pixels), cv2.COLOR_RGB2GRAY)[..., None], 3, 2
    )


def _crop(pixels: Array, share: float, at: tuple[float, float]) -> Array:
    height, width = pixels.shape[:2]
    h, w = round(share * height), round(share * width)
    top, left = round(at[1] * (height - h)), round(at[0] * (width - w))
    shown = pixels[top : top + h, left : left + w]
    return np.dstack([cv2.resize(p.copy(), (width, height)) for p in np.moveaxis(shown, 2, 0)])


def _ramp(pixels: Array, share: float, axis: int) -> Array:
    factor = 1 + share * np.linspace(0, 1, pixels.shape[axis])
    factor = factor[:, None, None] if axis == 0 else factor[None, :, None]
    return np.clip(np.rint(pixels * factor), 0, np.iinfo(pixels.dtype).max).astype(pixels.dtype)


def recorded(data: Path, presses: int, sensors: Sequence[Presses] = RECORDED) -> Iterator[Unit]:
    """Calibrate each recorded sensor on its presses and yield it with some of them."""
    for one in sensors:
        folder = data / one.folder
        paths = sorted(folder.glob(one.pattern))
        profile = load_profile(one.profile)
        with TemporaryDirectory() as place:
            links = Path(place) / "presses"
            links.mkdir()
            for path in paths:
                (links / path.name).symlink_to(path.resolve())
            made = calibrate(
                profile, links, folder / one.reference, ball_diameter_mm=one.ball_mm, scored=False
            )
        images = {"undeformed": read_image(folder / one.reference)}
        for path in paths[:: max(1, len(paths) // presses)][:presses]:
            images[path.stem] = read_image(path)
        pipeline = _pipeline(profile, made.bundle)
        yield Unit(one.name, pipeline, images, pipeline.frame)


def virtual(rig: str, seed: int, frames: int) -> Unit:
    """Calibrate a virtual unit and yield it with frames of every shape."""
    profile = load_profile(rig, sim=True)
    profile = vary(profile, seed) if seed else profile
    stage = VirtualStage(profile, seed)
    image = profile.image
    view = np.array([image.width_px, image.height_px]) * image.mm_per_px
    thick_mm = profile.gel.thickness_mm or 2.0
    ball_mm = round(float(min(0.22 * view[0], 2 * thick_mm)), 2)
    rng = np.random.default_rng([seed, 11])
    with TemporaryDirectory() as place:
        folder = Path(place)
        write_frame(folder / "reference", stage.frame(), "undeformed")
        for number in range(12):
            x_mm, y_mm = rng.uniform(-0.4, 0.4, 2) * view
            _press(
                stage,
                "sphere",
                rng.uniform(0.12, 0.22) * ball_mm,
                diameter_mm=ball_mm,
                x_mm=x_mm,
                y_mm=y_mm,
            )
            write_frame(folder / "presses", stage.frame(), f"press_{number:02d}")
        made = calibrate(
            profile,
            folder / "presses",
            folder / "reference",
            ball_diameter_mm=ball_mm,
            scored=False,
        )
    stage.reset()
    images = {"undeformed": stage.frame().pixels}
    for name, pixels in shapes(stage, rng, view, thick_mm, frames):
        images[name] = pixels
    pipeline = _pipeline(profile, made.bundle)
    shown = stage.frame()
    channels, full_scale = shown.channels, shown.full_scale

    def frame(pixels: Array) -> Frame:
        return Frame(np.ascontiguousarray(pixels), channels, image.mm_per_px, full_scale)

    return Unit(f"{rig} {seed}", pipeline, images, frame)


def shapes(
    stage: VirtualStage, rng: np.random.Generator, view: Array, thick_mm: float, count: int
) -> Iterator[tuple[str, Array]]:
    """Press objects of every shape, wide ones included."""
    width = float(view[0])
    for number in range(count):
        x_mm, y_mm = rng.uniform(-0.35, 0.35, 2) * view
        at: dict[str, Any] = {"x_mm": x_mm, "y_mm": y_mm, "angle_deg": float(rng.uniform(0, 180))}
        kind, options, deep = (
            ("sphere", {"diameter_mm": rng.uniform(0.1, 0.5) * width}, 0.4),
            (
                "cylinder",
                {"diameter_mm": rng.uniform(0.2, 0.6) * width, "length_mm": 0.5 * width},
                0.4,
            ),
            ("flat", {"size_mm": tuple(rng.uniform(0.2, 0.6, 2) * width)}, 0.25),
            ("sphere", {"diameter_mm": rng.uniform(0.8, 2.5) * width}, 0.4),
            ("coin", {}, 0.2),
            (
                "cylinder",
                {"diameter_mm": rng.uniform(0.3, 1.5) * width, "length_mm": 2.2 * width},
                0.4,
            ),
            ("flat", {"size_mm": (2.2 * width, 2.2 * width)}, 0.2),
            ("cone", {}, 0.3),
            ("flat", {"size_mm": (0.9 * width, 2.2 * width)}, 0.2),
            ("screw", {}, 0.3),
        )[number % 10]
        if number % 10 in (5, 6):
            at["x_mm"], at["y_mm"] = x_mm / 3, y_mm / 3
        try:
            _press(stage, kind, rng.uniform(0.1, 1) * deep * thick_mm, **at, **options)
            if number % 3 == 0:
                stage.shear(dx_mm=0.1 * thick_mm)
        except TactileError:
            continue
        yield f"{kind} {number}", stage.frame().pixels


def _press(stage: VirtualStage, kind: str, depth_mm: float, **options: Any) -> None:
    stage.reset()
    stage.indenter(kind, **{k: float(v) if np.isscalar(v) else v for k, v in options.items()})
    stage.press(depth_mm=float(depth_mm))


def _pipeline(profile: Profile, bundle: Bundle) -> Pipeline:
    kept = {name: step for name, step in profile.estimators.items() if name in ESTIMATORS}
    return Pipeline(profile.model_copy(update={"estimators": kept}), bundle)


def _matters(reading: Reading, before: Reading) -> bool:
    change_mm = np.abs(reading[HeightMap].mm - before[HeightMap].mm).max()
    area, was = reading[ContactMask].area_mm2, before[ContactMask].area_mm2
    return bool(change_mm > LEAST_HEIGHT_MM or abs(area - was) > LEAST_AREA * max(was, 1e-6))


class Table:
    """Counts of what was warned of, by kind."""

    def __init__(self) -> None:
        self.rows: dict[str, list[tuple[bool, str, str]]] = defaultdict(list)
        self.harmless = 0

    def add(self, kind: str, where: str, reading: Reading, before: Reading | None) -> None:
        shown = reading[ShownGel]
        if before is not None and not _matters(reading, before):
            self.harmless += 1
            return
        self.rows[kind].append((bool(reading.warnings), shown.cause or "", where))

    def show(self) -> None:
        print("kind: counted, warned, cause right; missed")
        every = [row for rows in self.rows.values() for row in rows]
        for kind, rows in [*self.rows.items(), ("all", every)]:
            warned = [row for row in rows if row[0]]
            right = [row for row in warned if row[1] == kind]
            missed = sorted({row[2] for row in rows if not row[0]})
            cause = len(right) / max(1, len(warned)) if kind != "all" else float("nan")
            share = len(warned) / len(rows)
            print(f"{kind:18s} {len(rows):5d} {share:6.3f} {cause:6.3f}  {missed[:6]}")
        print(f"harmless and not counted: {self.harmless}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, help="folder of recordings")
    parser.add_argument("--frames", type=int, default=10, help="frames of each virtual unit")
    parser.add_argument("--presses", type=int, default=5, help="presses of each recorded sensor")
    parser.add_argument("--seed", type=int, default=21, help="of the first virtual unit")
    arguments = parser.parse_args()
    table, false, own = Table(), list[str](), 0
    seeds = arguments.seed, arguments.seed + 1
    units = [virtual(rig, seed, arguments.frames) for rig in RIGS for seed in seeds]
    if arguments.data:
        units += recorded(arguments.data, arguments.presses)
    for unit in units:
        before: dict[str, Reading] = {}
        for name, pixels in unit.images.items():
            before[name] = unit.pipeline.process(unit.frame(pixels))
            own += 1
            if not before[name][ShownGel].this_gel:
                false.append(f"{unit.name}: {name}: {before[name][ShownGel].cause}")
        for number, name in enumerate(unit.images):
            if number > arguments.frames:
                break
            pixels = unit.images[name]
            for one in alterations(pixels.shape[2]):
                try:
                    reading = unit.pipeline.process(
                        unit.frame(np.ascontiguousarray(one.of(pixels)))
                    )
                except TactileError:
                    continue  # refused before it is measured
                where = f"{unit.name.split()[0]} {one.name}"
                table.add(one.kind, where, reading, before[name])
    others(units, table)
    table.show()
    print(f"own frames: {own}, warned of {len(false)}: {false}")


def others(units: list[Unit], table: Table) -> None:
    """Measure the frames of each unit with the bundles of others of the same design."""
    for unit in units:
        for other in units:
            alike = unit.name.split()[0] == other.name.split()[0] and unit is not other
            if not alike:
                continue
            for pixels in list(other.images.values())[:8]:
                reading = unit.pipeline.process(other.frame(pixels))
                own = other.pipeline.process(other.frame(pixels))
                table.add("another_unit", f"{other.name} in {unit.name}", reading, own)


if __name__ == "__main__":
    main()
