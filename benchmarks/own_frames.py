"""False alarms of the check of every frame: ``python benchmarks/own_frames.py [DATA]``.

Frames of recorded sensors with their own reference, without a bundle, and frames of calibrated
virtual units in contact with objects of every shape, wide ones included. None should be warned of.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from altered_frames import RIGS, recorded, virtual

from experiments.press_sets import HERE, SETS
from tactile_core import Pipeline, ShownGel, load_profile
from tactile_core.acquisition.acquisition import average
from tactile_core.acquisition.assembly import Assembly
from tactile_core.acquisition.devices import make_lights
from tactile_core.algorithms.arrays.types import Array
from tactile_core.formats.images import read_image
from tactile_core.formats.video import open_video
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Image

MINI, MARKED_MINI = HERE / "gelsight_mini.yaml", HERE / "mini_marked_virtual.yaml"
EVERY = 5
"""Frames of a video per frame that is checked."""


class Clip(NamedTuple):
    """Frames whose first is the undeformed gel."""

    name: str
    profile: Path | str
    images: Iterable[Array]


def clips(data: Path) -> Iterator[Clip]:
    """Yield everything that is recorded with an undeformed frame of its own."""
    hexagonal = data / SETS[3].folder
    yield Clip("hex presses", SETS[3].profile, _files(hexagonal, "frame0.jpg", "Im_*.jpg"))
    yield Clip("mini objects", MINI, _files(data / "gelsight_mini", "background.png", "[bk]e*.png"))
    yield Clip("mini markers", MARKED_MINI, _files(data / "markers/mini/frames", "*"))
    for folder in sorted(path for path in data.glob("slip/grasp_lift/*/*") if path.is_dir()):
        yield Clip("grasp_lift", SETS[3].profile, _files(folder, "*"))
    for name, profile, pattern in (
        ("gripper_pair", HERE / "gripper_finger.yaml", "slip/gripper_pair/*/*/*.avi"),
        ("grip", HERE / "grip_wedge.yaml", "force/grip/*.avi"),
        ("octopi", MINI, "hardness/octopi/*.mov"),
    ):
        for path in sorted(data.glob(pattern)):
            yield Clip(name, profile, _video(path))


def _files(folder: Path, *patterns: str) -> Iterator[Array]:
    for pattern in patterns:
        for path in sorted(folder.glob(pattern)):
            yield read_image(path)


def _video(path: Path) -> Iterator[Array]:
    for pixels, _ in islice(open_video(path).frames(), 0, None, EVERY):
        yield pixels


def readings(clip: Clip) -> Iterator[Reading]:
    """Measure nothing of a clip's frames but what they show."""
    profile = load_profile(clip.profile).model_copy(update={"estimators": {}})
    images = iter(clip.images)
    assembly = Assembly(make_lights(profile), profile.image)
    undeformed = average([assembly.frame([Image(next(images), 0.0)])])
    pipeline = Pipeline(profile, reference=undeformed)
    for pixels in images:
        yield pipeline.process(pipeline.frame(pixels))


class Counts:
    """Warnings per kind of recording."""

    def __init__(self) -> None:
        self.frames: Counter[str] = Counter()
        self.warned: Counter[tuple[str, Any]] = Counter()

    def add(self, name: str, detail: str, reading: Reading) -> None:
        shown = reading[ShownGel]
        self.frames[name] += 1
        if not shown.this_gel:
            self.warned[name, f"{detail} {shown.cause}".strip()] += 1

    def show(self) -> None:
        for name, count in self.frames.items():
            found = {why: n for (which, why), n in self.warned.items() if which == name}
            print(f"{name:30s} {count:6d} frames, {sum(found.values()):4d} warned {found or ''}")
        total, warned = self.frames.total(), self.warned.total()
        print(f"{'all':30s} {total:6d} frames, {warned:4d} warned: {warned / total:.2%}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, help="folder of recordings")
    parser.add_argument("--frames", type=int, default=200, help="of each of ten virtual units")
    parser.add_argument("--seed", type=int, default=51, help="of the first virtual unit")
    arguments = parser.parse_args()
    counts = Counts()
    if arguments.data:
        for clip in clips(arguments.data):
            for reading in readings(clip):
                counts.add(clip.name, "", reading)
        for unit in recorded(arguments.data, 1000):
            for pixels in unit.images.values():
                counts.add(
                    f"{unit.name} (calibrated)", "", unit.pipeline.process(unit.frame(pixels))
                )
        counts.show()
    for rig in RIGS:
        for seed in (arguments.seed, arguments.seed + 1):
            unit = virtual(rig, seed, arguments.frames)
            for name, pixels in unit.images.items():
                reading = unit.pipeline.process(unit.frame(pixels))
                counts.add(f"virtual {rig}", name.split()[0], reading)
    counts.show()


if __name__ == "__main__":
    main()
