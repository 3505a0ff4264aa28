"""Corrupted input files of commands."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from random import Random

from fuzz import recipes
from fuzz.areas.command_lines import bundle_files, unusual_files
from fuzz.attempt import Attempt
from fuzz.mutations import corrupt as corrupt_one
from fuzz.mutations import corrupt_folder
from fuzz.sandbox import Sandbox

Words = Sequence[str]


def _attempt(box: Sandbox, words: Words, *targets: str) -> Attempt:
    """Return a command with one corrupted target; each further number corrupts another."""
    places = [box.work / target for target in targets]

    def corrupt(rng: Random) -> None:
        corrupt_one(rng.choice(places), rng)

    return Attempt(list(words), corrupt=corrupt)


def profiles(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt a profile: for checking, running, calibrating, simulating and inheriting."""
    words, name = rng.choice(
        (
            (["validate", "small.yaml"], "small"),
            (["validate", "marked.yaml"], "marked"),
            (["validate", "touched.yaml"], "touched"),
            (["validate", "turn.yaml"], "turn"),
            (["validate", "marked.yaml", "small.yaml"], "small"),
            (recipes.DOCTOR, "small"),
            (recipes.RUN, "small"),
            (recipes.RUN_SIM, "small"),
            (recipes.RUN_MARKED, "marked"),
            (recipes.RUN_SCAN, "turn"),
            (recipes.CALIBRATE, "small"),
            (recipes.SIMULATE, "small"),
            (["new", "mine", "--from", "marked.yaml", "--image", "ref.png"], "marked"),
        )
    )
    return _attempt(box, words, f"{name}.yaml")


def images(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt an image: an input, a reference, a press, or the image of a new profile."""
    words, *targets = rng.choice(
        (
            (recipes.RUN_IMAGE, "frame.jpg"),
            (recipes.RUN_IMAGE, "ref.png"),
            (recipes.RUN, "frames/ball.png", "frames/rest.png"),
            (recipes.RUN_SCAN, "scan/light0.png", "scan/light2.png"),
            (recipes.RUN_MARKED, "sheared/frames/000003.png"),
            (recipes.RUN_MARKED, "sheared/reference/undeformed.png"),
            (recipes.CALIBRATE, "presses/press_0.png", "presses/press_2.png"),
            (recipes.CALIBRATE, "ref.png"),
            (recipes.CALIBRATE_GRID, "balls.png"),
            (recipes.NEW, "ref.png"),
        )
    )
    return _attempt(box, words, *targets)


def folders(box: Sandbox, rng: Random) -> Attempt:
    """Change the content of an input folder."""
    unusual_files(box)
    words, target = rng.choice(
        (
            (recipes.RUN, "frames"),
            (recipes.RUN_SCAN, "scan"),
            (recipes.RUN_SCANS, "scans"),
            (recipes.RUN_MARKED, "sheared/frames"),
            (recipes.CALIBRATE, "presses"),
            (recipes.CALIBRATE_MAP, "scan"),
            (recipes.NEW_PRESSES, "presses"),
        )
    )
    return Attempt(list(words), corrupt=lambda rng: corrupt_folder(box.work / target, rng))


def videos(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt a video: an input, presses, or the image of a new profile."""
    calibrated = ["calibrate", "small.yaml", "--presses", "film.avi", "--reference", "ref.png"]
    words = rng.choice(
        (
            recipes.RUN_VIDEO,
            recipes.RUN_VIDEO,
            [*calibrated, "--ball-diameter-mm", "3", "--out", "fresh"],
            ["new", "mine", "--from", "small.yaml", "--image", "film.avi", "--scale", "0.1"],
        )
    )
    if rng.random() < 0.15:
        other = rng.choice((".mp4", ".mov", ".mkv", ".webm", ".mpg"))
        shutil.copy(box.work / "film.avi", box.work / f"film{other}")
        words = [word.replace("film.avi", f"film{other}") for word in words]
        return _attempt(box, words, f"film{other}")
    return _attempt(box, words, "film.avi")


def scans(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt a ``scan.yaml`` of the input, of one scan of several, or of presses."""
    words, target = rng.choice(
        (
            (recipes.RUN_SCAN, "scan/scan.yaml"),
            (recipes.RUN_SCANS, "scans/one/scan.yaml"),
            (recipes.CALIBRATE_MAP, "scan/scan.yaml"),
            (recipes.CALIBRATE_MAP, "level/scan.yaml"),
        )
    )
    return _attempt(box, words, target)


def targets(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt a ball grid or a height map."""
    words, target = rng.choice(
        (
            (recipes.CALIBRATE_GRID, "grid.yaml"),
            (recipes.CALIBRATE_GRID, "grid.yaml"),
            (recipes.CALIBRATE_MAP, "map.tmd"),
            (
                [
                    "new",
                    "mine",
                    "--from",
                    "small.yaml",
                    "--image",
                    "balls.png",
                    "--target",
                    "grid.yaml",
                ],
                "grid.yaml",
            ),
        )
    )
    return _attempt(box, words, target)


def labels(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt the CSV of circles."""
    return _attempt(box, recipes.CALIBRATE_LABELS, "labels.csv")


def bundles(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt a bundle, with or without updating its hashes."""
    words, name = rng.choice(
        (
            (recipes.RUN, "bundle"),
            (recipes.RUN_IMAGE, "bundle"),
            (recipes.RUN_SCAN, "turn_bundle"),
            (["calibrate", *recipes.CALIBRATE[1:-3], "--out", "bundle"], "bundle"),
        )
    )
    folder = box.work / name
    ours = bundle_files(box)
    targets = [
        folder / "manifest.json",
        folder / "manifest.json",
        *sorted(folder.glob("*.npz")),
        folder,
    ]
    # in calibrate the hashes are not updated: a listed file would count as the bundle's
    sealed = words[0] == "run" and rng.random() < 0.7

    def corrupt(rng: Random) -> None:
        corrupt_one(rng.choice(targets), rng)
        if sealed:
            seal(box, name)

    return Attempt(list(words), corrupt=corrupt, ours=ours if words[0] == "calibrate" else ())


def seal(box: Sandbox, name: str) -> None:
    """Update the hashes of a corrupted bundle, so that it passes the integrity check."""
    from tactile_core.bundles.manifest import Manifest, write_manifest

    folder = box.work / name
    if not (folder / "manifest.json").is_file():
        return  # reading a pipe would never end
    try:
        text = (folder / "manifest.json").read_text()
        write_manifest(folder, Manifest.model_validate_json(text))
    except (OSError, ValueError, MemoryError):
        return  # an unreadable file is refused before the hashes are compared


def scripts(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt a script of the virtual stage, or its mesh or height map."""
    path = box.work / "script.yaml"
    text, extra = path.read_text(), ""
    kind = rng.randrange(4)
    if kind == 0:
        extra = "heightmap, path: map.tmd"
    elif kind == 1:
        extra = "mesh, path: block.stl"
    if extra:
        path.write_text(text.replace("sphere, diameter_mm: 3", extra))
    other = {0: "map.tmd", 1: "block.stl"}.get(kind, "script.yaml")
    words = rng.choice((recipes.SIMULATE, recipes.SIMULATE, recipes.RUN_SIM))
    attempt = _attempt(box, words, "script.yaml", other)
    spoil = attempt.corrupt

    def corrupt(rng: Random) -> None:
        spoil(rng)
        if path.is_file() and path.stat().st_size < 10_000:
            # a hundred thousand frames are no fault, they only take long
            shorter = re.sub(rb"(frames\W+)\d{3,7}\b", rb"\g<1>99", path.read_bytes())
            path.write_bytes(shorter)

    attempt.corrupt = corrupt
    return attempt


def truths(box: Sandbox, rng: Random) -> Attempt:
    """Corrupt the ground truth of ``compare``."""
    words = list(recipes.COMPARE)
    if rng.random() < 0.5:
        words += [
            "--swap",
            rng.choice(("height=core.robust_poisson", "height", "=", "x=y", "a=b=c")),
        ]
    attempt = _attempt(box, words, "played/truth", "played/truth/000001.npz", "played/frames")
    attempt.cpu_s = 60
    return attempt
