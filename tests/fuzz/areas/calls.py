"""Python entry points with wrong numbers, arrays and names, and with corrupted files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from fuzz.arrays import changed_array
from fuzz.attempt import Attempt
from fuzz.mutations import corrupt as corrupt_one
from fuzz.sandbox import Sandbox
from fuzz.values import NUMBERS as ALL_NUMBERS
from fuzz.values import WORDS

Call = Callable[[Random], Any]

NUMBERS = tuple(number for number in ALL_NUMBERS if number != 10**400)
"""The numbers that Python can convert to float."""


def entry_points(box: Sandbox, rng: Random) -> Attempt:
    """Return one call, with random arguments for each number of the case."""
    call = rng.choice(_CALLS)
    file = rng.choice(_FILES.get(call, ("",)))
    inner = Random(rng.random())

    def corrupt(rng: Random) -> None:
        if file:
            corrupt_one(box.work / file, rng)
        inner.seed(rng.random())

    def do() -> None:
        call(inner, Path(file)) if file else call(inner)

    return Attempt(call=do, corrupt=corrupt)


def _number(rng: Random, good: Any) -> Any:
    return good if rng.random() < 0.5 else rng.choice(NUMBERS)


def _array(rng: Random, good: Any) -> Any:
    return good if rng.random() < 0.4 else changed_array(good, rng)


def _word(rng: Random, good: str) -> str:
    return good if rng.random() < 0.5 else rng.choice(WORDS)


def _integrated(rng: Random) -> Any:
    from tactile_core.algorithms.poisson import integrate

    level = np.linspace(-0.1, 0.1, 12 * 10, dtype=np.float32).reshape(10, 12)
    return integrate(
        _array(rng, level),
        _array(rng, level),
        mm_per_px=_number(rng, 0.1),
        boundary=_word(rng, rng.choice(("neumann", "dirichlet"))),  # type: ignore[arg-type]
    )


def _profile_named(rng: Random) -> Any:
    from tactile_core.profiles.loader import load_profile

    return load_profile(_word(rng, "small.yaml"))


def _profile_changed(rng: Random) -> Any:
    from tactile_core.profiles.loader import load_profile

    section, key = rng.choice(
        (
            ("image", "mm_per_px"),
            ("image", "width_px"),
            ("gel", "thickness_mm"),
            ("gel", "friction"),
            ("gel", "markers"),
            ("calibration", "use"),
            ("optics", "ambient"),
            ("image", "crop"),
        )
    )
    return load_profile("marked.yaml", overrides={section: {key: rng.choice((*NUMBERS, *WORDS))}})


def _staged(rng: Random) -> Any:
    from tactile_sim import VirtualStage

    overrides = {"gel": {"friction": _number(rng, 0.5)}} if rng.random() < 0.3 else None
    mode = _word(rng, "fast") if rng.random() < 0.2 else "fast"
    seed = _number(rng, 0) if rng.random() < 0.2 else 0
    stage = VirtualStage("small.yaml", seed, mode, overrides)  # type: ignore[arg-type]
    kind = _word(rng, rng.choice(("sphere", "cylinder", "flat", "cone", "heightmap", "coin")))
    sizes: dict[str, Any] = {
        "sphere": {"diameter_mm": _number(rng, 3)},
        "cylinder": {"diameter_mm": _number(rng, 3), "length_mm": _number(rng, 5)},
        "flat": {"size_mm": (_number(rng, 2), _number(rng, 2))},
        "cone": {"diameter_mm": _number(rng, 3)},
        "heightmap": {"height_mm": _array(rng, np.eye(9)), "mm_per_px": _number(rng, 0.1)},
    }.get(kind, {"diameter_mm": 3})
    stage.indenter(kind, **sizes, x_mm=rng.choice((0, 0, 0, *NUMBERS)))
    for _ in range(rng.randrange(1, 4)):
        move = rng.randrange(6)
        if move < 2:
            stage.press(**{rng.choice(("depth_mm", "force_n")): _number(rng, 0.2)})
        elif move == 2:
            stage.shear(_number(rng, 0.1), _number(rng, 0), steps=rng.choice((1, 1, 0, -1)))
        elif move == 3:
            stage.twist(_number(rng, 1))
        elif move == 4:
            stage.hold(_number(rng, 0.1))
        else:
            stage.release(_number(rng, 0.1))
    return stage.frame(), stage.truth()


def _measured(rng: Random) -> Any:
    from tactile_core.pipeline.pipeline import Pipeline
    from tactile_core.quantities import Frame, Reference

    names = ("red", "green", "blue")
    pixels = np.full((60, 80, 3), 128, np.uint8)
    reference = None
    if rng.random() < 0.5:
        channels = rng.choice((names, names, (), ("red",), ("a", "b", "c")))
        reference = Reference(_array(rng, pixels.astype(np.float32)), channels)
    pipeline = Pipeline("small.yaml", Path("bundle") if rng.random() < 0.8 else None, reference)
    channels = rng.choice((names, names, names, (), ("red",), ("a", "b", "c")))
    return pipeline.process(Frame(_array(rng, pixels), channels, _number(rng, 0.1)), tare=True)


def _opened(rng: Random) -> Any:
    from tactile_core import open_sensor

    with open_sensor(
        _word(rng, "small.yaml"),
        serial=rng.choice((None, None, "0007", *WORDS)),
        bundle=rng.choice((None, "bundle", "bundle", "turn_bundle", *WORDS)),
        input=rng.choice((None, "frames", "frames", *WORDS)),
        reference=rng.choice((None, "ref.png", "first", *WORDS)),
        sim=rng.random() < 0.2,
    ) as sensor:
        for _ in range(rng.randrange(4)):
            action = rng.randrange(4)
            if action == 0:
                sensor.tare()
            elif action == 1:
                sensor.capture_reference(rng.choice((1, 2, 0, -1)))
            else:
                sensor.read(_number(rng, 1.0))
    return sensor.read()


def _calibrated(rng: Random) -> Any:
    from tactile_core.calibration.fitting import calibrate

    return calibrate(
        "small.yaml",
        Path(_word(rng, "presses")),
        Path(_word(rng, "ref.png")),
        ball_diameter_mm=_number(rng, 3.0),
        labels=rng.choice((None, Path("labels.csv"), Path("small.yaml"), Path("nowhere"))),
        model=rng.choice((None, None, *WORDS)),
        serial=rng.choice(("", "7", *WORDS)),
        rows=rng.choice((None, None, slice(0, 5))),
        scored=False,
    )


def _written(rng: Random) -> Any:
    from tactile_core.formats.images import write_png
    from tactile_core.formats.npz import write_npz
    from tactile_core.formats.tmd import write_tmd

    level = np.zeros((6, 8), np.float32)
    kind = rng.randrange(3)
    if kind == 0:
        return write_tmd(
            Path("new.tmd"), _array(rng, level), _number(rng, 0.1), comment=_word(rng, "ours")
        )
    if kind == 1:
        return write_png(Path("new.png"), _array(rng, level.astype(np.uint8)))
    return write_npz(Path("new.npz"), {_word(rng, "a"): _array(rng, level)})


def _image_read(rng: Random, path: Path) -> Any:
    from tactile_core.formats.images import image_kind, read_image

    return image_kind(path), read_image(path)


def _npz_read(rng: Random, path: Path) -> Any:
    from tactile_core.formats.npz import read_npz

    return read_npz(path)


def _tmd_read(rng: Random, path: Path) -> Any:
    from tactile_core.formats.tmd import read_tmd

    return read_tmd(path)


def _target_read(rng: Random, path: Path) -> Any:
    from tactile_core.formats.target import read_target

    return read_target(path).at_scale(_number(rng, 0.1))


def _labels_read(rng: Random, path: Path) -> Any:
    from tactile_core.formats.labels import read_labels

    return read_labels(path)


def _scan_read(rng: Random, path: Path) -> Any:
    from tactile_core.formats.scan import read_scan

    return read_scan(path)


def _video_read(rng: Random, path: Path) -> Any:
    from tactile_core.formats.video import open_video

    return list(open_video(path).frames())


def _recording_read(rng: Random, path: Path) -> Any:
    from tactile_core.recordings.recording import open_recording

    return list(open_recording(path, images_per_observation=rng.choice((1, 1, 3, 3, 0, -1))))


def _bundle_read(rng: Random, path: Path) -> Any:
    from tactile_core.bundles.bundle import Bundle

    return Bundle.load(path)


def _played(rng: Random, path: Path) -> Any:
    from tactile_sim import VirtualStage
    from tactile_sim.script import Script
    from tactile_sim.simulation import simulate

    return simulate(VirtualStage("small.yaml"), Script(path), Path(rng.choice(("new", "frames"))))


_FILES: dict[Any, tuple[str, ...]] = {
    _image_read: ("ref.png", "frame.jpg"),
    _npz_read: ("bundle/reference.npz", "played/truth/000001.npz"),
    _tmd_read: ("map.tmd",),
    _target_read: ("grid.yaml",),
    _labels_read: ("labels.csv",),
    _scan_read: ("scan/scan.yaml",),
    _video_read: ("film.avi",),
    _recording_read: ("frames", "scan", "scans", "film.avi", "scan/scan.yaml", "frame.jpg"),
    _bundle_read: ("bundle", "bundle/manifest.json", "turn_bundle", "bundle/reference.npz"),
    _played: ("script.yaml",),
}
_CALLS: tuple[Any, ...] = (
    *_FILES,
    *(_integrated, _profile_named, _profile_changed, _staged, _staged, _measured, _measured),
    *(_opened, _opened, _calibrated, _written),
)
