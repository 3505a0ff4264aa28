"""What moves if a parameter is halved or half as large again: ``python benchmarks/parameters.py``.

Parameters are the numbers of the classes in capitals, and numeric constants of modules. Recorded
presses, lifts and grasps and rendered sequences are measured with each changed, one at a time, and
compared with what they were: heights and displacements by the RMS of the change relative to the RMS
of the quantity, contacts by 1 - IoU, slip by the change of its degree and of its state. A parameter
that moves nothing decides nothing.

``python benchmarks/parameters.py [DATA] [--only PART ...] [--named NAME ...] [--least SHARE]``
"""

from __future__ import annotations

import argparse
import functools
import gc
import importlib
import multiprocessing
import pkgutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from altered_frames import recorded
from slip_virtual import PROFILE, calibrated, drawn, shots, undeformed

import tactile_core
from experiments.press_sets import HERE
from experiments.sheared_markers import Shear, detected, strokes, visible
from tactile_core import ContactMask, HeightMap, Pipeline, SlipState, load_profile
from tactile_core.acquisition.acquisition import average
from tactile_core.acquisition.assembly import Assembly
from tactile_core.acquisition.devices import make_lights
from tactile_core.algorithms.markers.tracker import MarkerTracker
from tactile_core.bundles.bundle import Bundle
from tactile_core.quantities import DisplacementField, Frame, MarkerField, Wrench
from tactile_core.recordings.recording import open_recording

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
LIFTS = ("slip/grasp_lift", "hex_fingertip", 30, 1)
GRASPS = ("slip/gripper_pair", str(HERE / "gripper_finger.yaml"), 50, 1)
"""Folder, profile, frames and interval of recordings of slip, of which two are measured."""

PRESSES, SEQUENCES, SEED = 3, 2, 11
"""Recorded presses of each sensor; rendered sequences, and their seed."""

STROKES = (Shear(2.0, 0.35, spurious=0.02), Shear(2.0, 0.7, spurious=0.05))
FACTORS = (0.5, 1.5)
CORES = 2


@dataclass(frozen=True)
class Case:
    """A pipeline, and frames to measure in order."""

    name: str
    make: Callable[[], Pipeline]
    frames: tuple[Frame, ...]

    def measure(self) -> dict[str, list[Any]]:
        """Return the values of each quantity in each frame."""
        pipeline, found = self.make(), dict[str, list[Any]]()
        for frame in self.frames:
            reading = pipeline.process(frame)
            for kind, value_of in KINDS.items():
                if kind in reading.quantities:
                    found.setdefault(kind.__name__, []).append(value_of(reading[kind]))
        return found


@dataclass(frozen=True)
class Strokes:
    """Markers of a virtual stroke, a third of them undetected, and spurious ones among them."""

    shear: Shear

    def measure(self) -> dict[str, list[Any]]:
        """Return the displacements of the markers in each frame."""
        positions_px = strokes(SEED, self.shear)
        tracker = MarkerTracker(positions_px[0][visible(positions_px[0])])
        rng, places = np.random.default_rng(SEED), []
        for truth in positions_px:
            tracker.update(detected(truth, self.shear, rng)[0])
            places.append(tracker.px - tracker.reference_px)
        return {"tracking": places}


class Parameter(NamedTuple):
    """A number, and where it is: a class or a module."""

    holder: Any
    name: str

    @property
    def title(self) -> str:
        module = getattr(self.holder, "__module__", self.holder.__name__)
        inside = "" if module == self.holder.__name__ else f"{self.holder.__name__}."
        return f"{module.removeprefix('tactile_core.')} {inside}{self.name}"


def parameters(parts: list[str]) -> list[Parameter]:
    """Find every numeric parameter in modules whose name contains one of the parts."""
    found = []
    for info in pkgutil.walk_packages(tactile_core.__path__, "tactile_core."):
        if not any(part in info.name for part in parts):
            continue
        module = importlib.import_module(info.name)
        for name, value in vars(module).items():
            if isinstance(value, type) and name.isupper() and value.__module__ == info.name:
                found += [Parameter(value, key) for key in vars(value) if _is_number(value, key)]
            elif name.strip("_").isupper() and _is_number(module, name):
                defined = f"\n{name} = " in Path(str(module.__file__)).read_text()
                found += [Parameter(module, name)] if defined else []
    return found


def _is_number(holder: Any, name: str) -> bool:
    value = vars(holder)[name]
    if name.startswith("__") or isinstance(value, bool):
        return False
    if isinstance(value, tuple):
        return bool(value) and all(type(one) in (int, float) for one in value)
    return type(value) in (int, float)


def cases(data: Path) -> Iterator[Case | Strokes]:
    """Yield strokes, recorded presses, lifts, grasps, and rendered sequences."""
    yield from (Strokes(shear) for shear in STROKES)
    for unit in recorded(data, PRESSES):
        profile, bundle = unit.pipeline.profile, unit.pipeline.bundle
        frames = tuple(unit.frame(image) for image in unit.images.values())
        yield Case(unit.name, functools.partial(Pipeline, profile, bundle), frames)
    for folder, name, count, every in (LIFTS, GRASPS):
        profile = load_profile(name)
        assembly = Assembly(make_lights(profile), profile.image)
        sources = sorted(p for p in (data / folder).glob("*/*") if not p.name.startswith("."))
        videos = [video for p in sources for video in (sorted(p.glob("*.avi")) or [p])]
        for video in videos[:: len(videos) // 2][:2]:
            taken = islice(open_recording(video), 0, count * every, every)
            frames = tuple(
                assembly.frame([replace(one.images[0], timestamp_s=n * every / 30)])
                for n, one in enumerate(taken)
            )
            reference = average(frames[:1])
            yield Case(video.stem, functools.partial(Pipeline, profile, None, reference), frames)
    with TemporaryDirectory() as place:
        bundle = Bundle.load(calibrated(Path(place)))
    for plan in drawn(SEQUENCES, SEED):
        frames = tuple(shot.frame for shot in shots(plan))
        reference = undeformed(frames[0])
        profile = load_profile(PROFILE)
        forced = load_profile("hex_fingertip_force")
        made = functools.partial(Pipeline, profile, bundle, reference)
        yield Case(f"virtual {plan.shape}", made, frames[1:])
        by_force = replace(bundle, manifest=bundle.manifest)
        made = functools.partial(Pipeline, forced, by_force, reference)
        yield Case(f"virtual force {plan.shape}", made, frames[1::6])


KINDS: dict[Any, Callable[[Any], Any]] = {
    HeightMap: lambda q: q.mm[::4, ::4].copy(),
    ContactMask: lambda q: q.mask[::4, ::4].copy(),
    DisplacementField: lambda q: q.full("mm")[::8, ::8].copy(),
    MarkerField: lambda q: np.where(q.seen[:, None], q.px - q.reference_px, 0),
    SlipState: lambda q: (q.degree, q.state),
    Wrench: lambda q: np.array([q.fx_n, q.fy_n, q.fz_n]),
}


def change(kind: str, before: list[Any], now: list[Any]) -> float:
    """Return how far a quantity of all frames has moved, 0 to 1 and above."""
    if len(before) != len(now) or any(
        np.shape(a) != np.shape(b) for a, b in zip(before, now, strict=False)
    ):
        return 1.0
    if kind == "SlipState":
        pairs = list(zip(before, now, strict=True))
        return float(np.mean([abs(a[0] - b[0]) / 2 + (a[1] != b[1]) / 2 for a, b in pairs]))
    old, new = np.concatenate([b.ravel() for b in before]), np.concatenate([n.ravel() for n in now])
    if kind == "ContactMask":
        return 1 - float((old & new).sum() / max(1, (old | new).sum()))
    return float(np.linalg.norm(new - old) / max(np.linalg.norm(old), 1e-12))


def _set(parameter: Parameter, factor: float) -> bool:
    """Change a parameter wherever its module gave it to; False if there is no other value."""
    holder, name = parameter
    before = getattr(holder, name)
    now = (
        tuple(_times(v, factor) for v in before)
        if isinstance(before, tuple)
        else _times(before, factor)
    )
    if now == before:
        return False
    setattr(holder, name, now)
    for each in gc.get_objects():
        if isinstance(each, functools._lru_cache_wrapper):
            each.cache_clear()
        elif isinstance(each, FunctionType) and str(each.__module__).startswith("tactile_core"):
            defaults = each.__kwdefaults__ or {}
            defaults |= {key: now for key, value in defaults.items() if value is before}
    for module in [m for n, m in sys.modules.items() if n.startswith("tactile_core")]:
        if vars(module).get(name) is before and isinstance(before, float):
            setattr(module, name, now)
    return True


def _times(value: float, factor: float) -> float:
    if isinstance(value, float):
        return value * factor
    if factor < 1:
        return min(value - 1, round(value * factor)) if value > 1 else value
    return max(value + 1, round(value * factor))


def _moved(task: tuple[int, float]) -> tuple[int, float, dict[str, float], str]:
    number, factor = task
    moved, fault = dict[str, float](), ""
    try:
        if _set(_PARAMETERS[number], factor):
            for case, before in zip(_CASES, _BEFORE, strict=True):
                for kind, values in case.measure().items():
                    moved[kind] = max(moved.get(kind, 0), change(kind, before[kind], values))
    except Exception as error:  # a parameter may have no other value
        fault = f"{type(error).__name__}: {error}"[:60]
    return number, factor, moved, fault


_PARAMETERS: list[Parameter] = []
_CASES: list[Case | Strokes] = []
_BEFORE: list[dict[str, list[Any]]] = []
"""What the processes share; they are forked."""


def main() -> None:
    """Print a line for each parameter, those that move most first."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=DATA)
    parser.add_argument("--only", nargs="*", default=["algorithms", "builtin", "conditioning"])
    parser.add_argument("--named", nargs="*", help="of these the parameters of these names alone")
    parser.add_argument("--least", type=float, default=0.0, help="of a change that is printed")
    asked = parser.parse_args()
    found = parameters(asked.only)
    _PARAMETERS.extend(one for one in found if not asked.named or one.name in asked.named)
    _CASES.extend(cases(asked.data))
    _BEFORE.extend(case.measure() for case in _CASES)
    tasks = [(n, factor) for n in range(len(_PARAMETERS)) for factor in FACTORS]
    largest: dict[int, dict[float, dict[str, float]]] = {n: {} for n in range(len(_PARAMETERS))}
    with multiprocessing.get_context("fork").Pool(CORES, maxtasksperchild=1) as pool:
        for done, (n, factor, moved, fault) in enumerate(pool.imap_unordered(_moved, tasks), 1):
            largest[n][factor] = moved
            print(f"{done}/{len(tasks)} {_PARAMETERS[n].title} × {factor} {fault}", file=sys.stderr)
    for n in sorted(largest, key=lambda n: -_greatest(largest[n])):
        if _greatest(largest[n]) >= asked.least:
            print(f"{_PARAMETERS[n].title} = {getattr(*_PARAMETERS[n])}", flush=True)
            for factor in FACTORS:
                top = {kind: value for kind, value in largest[n][factor].items() if value >= 0.0005}
                shown = ", ".join(f"{kind} {value:.3f}" for kind, value in top.items())
                print(f"    × {factor}: {shown or 'nothing'}", flush=True)


def _greatest(moved: dict[float, dict[str, float]]) -> float:
    return max((value for one in moved.values() for value in one.values()), default=0.0)


if __name__ == "__main__":
    main()
