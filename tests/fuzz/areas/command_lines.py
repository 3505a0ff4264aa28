"""Options with wrong values, and results that would overwrite the user's files."""

from __future__ import annotations

import shutil
from pathlib import Path
from random import Random

from fuzz import recipes
from fuzz.attempt import Attempt
from fuzz.sandbox import Sandbox
from fuzz.values import NUMBERS, PATHS, WORDS, word_of

_OPTIONS = (
    *("--serial", "--sim", "--script", "--input", "--reference", "--bundle", "--tare-frame"),
    *("--frames", "--save", "--json", "--presses", "--ball-diameter-mm", "--labels", "--target"),
    *("--rows", "--model", "--seed", "--mode", "--swap", "--truth", "--size", "--calibration"),
    *("--from", "--image", "--scale", "--scale-image", "--measured-with"),
    *("--plugin", "--force", "--help", "--version", "--nothing", "-x", "--js", "--ou"),
)
_BENCHES = (
    *(["bench", "small.yaml", "--size", size] for size in ("0x0", "x", "1e3x5", "99999x99999", "")),
    *(
        ["bench", "small.yaml", "--calibration", use]
        for use in ("core.", "core.x", "", "x.y", "..")
    ),
)
_LONE = (
    [],
    ["--help"],
    ["--version"],
    ["nothing"],
    ["run"],
    [""],
    ["--"],
    ["-"],
    ["run", "--help"],
)
_OUTS = (
    *(
        ".",
        "..",
        "presses",
        "frames",
        "bundle",
        "turn_bundle",
        "scan",
        "scans",
        "played",
        "ref.png",
    ),
    *("small.yaml", "small.yaml/inside", "nowhere/inside/out", "home", "link", "dangling", "loop"),
    *(
        "fifo",
        "empty",
        "web",
        "a" * 300,
        "\udcff",
        "new\nline",
        "é",
        "fresh/../presses",
        "presses/",
    ),
)


def options(box: Sandbox, rng: Random) -> Attempt:
    """Return a valid command line with one word changed, removed, repeated or added."""
    unusual_files(box)
    kind = rng.random()
    if kind < 0.05:
        return Attempt(list(rng.choice(_LONE)))
    words = list(rng.choice(_BENCHES) if kind < 0.1 else rng.choice(recipes.ALL))
    if kind >= 0.05 and words[0] == "bench":
        return Attempt(words)
    attempt = Attempt(words, ours=bundle_files(box) if words[0] == "calibrate" else ())

    def corrupt(rng: Random) -> None:
        attempt.words[:] = _safe(_changed(attempt.words, rng))

    attempt.corrupt = corrupt
    return attempt


def bundle_files(box: Sandbox) -> tuple[Path, ...]:
    """Return the files of the bundles, which another calibration may replace."""
    folders = (box.work / "bundle", box.work / "turn_bundle")
    return tuple(file.relative_to(box.work) for folder in folders for file in folder.iterdir())


def outputs(box: Sandbox, rng: Random) -> Attempt:
    """Return a valid command whose ``--out`` is unusual or already exists."""
    unusual_files(box)
    words = list(rng.choice(recipes.WRITING))
    at = words.index("--out") + 1
    words[at] = rng.choice(_OUTS)
    folder = box.work / "web"
    (folder / "src").mkdir(parents=True)
    (folder / "src" / "app.js").write_text("let a = 1\n")
    manifest = rng.choice(('{"name": "web extension"}', '{"format": 1}', "{", "[]", "null", ""))
    (folder / "manifest.json").write_text(manifest)
    attempt = Attempt(words, ours=bundle_files(box) if words[0] == "calibrate" else ())
    kind = rng.randrange(6)
    if kind == 0 and words[0] in ("calibrate", "run"):
        # a bundle that contains files of the user
        words[at] = "bundle"
        (box.work / "bundle" / "notes.txt").write_text("mine\n")
    elif kind == 1:
        words += rng.choice((["--bundle", words[at]], ["--reference", f"{words[at]}/press_0.png"]))
    elif kind == 2 and words[0] == "run":
        (box.work / "out").mkdir()
        shutil.copy(box.work / "ref.png", box.work / "out" / "ball_normals.png")
        shutil.copy(box.work / "ref.png", box.work / "out" / "mine.png")
        words[at] = "out"
    elif kind == 3 and words[0] == "run":
        shutil.copy(box.work / "ref.png", box.work / "frames" / "ball_normals.png")
        words[at] = "out"
    elif kind == 4 and words[0] == "new":
        words += ["--force"]

    def corrupt(rng: Random) -> None:
        if rng.random() < 0.3:
            attempt.words[:] = _safe(_changed(attempt.words, rng))

    attempt.corrupt = corrupt
    return attempt


def unusual_files(box: Sandbox) -> None:
    """Create files and links that are not recordings, with the names used in the values."""
    work = box.work
    (work / "empty").mkdir()
    (work / "empty.png").write_bytes(b"")
    (work / "home").mkdir()
    (work / "odd").mkdir()
    shutil.copy(work / "ref.png", work / "odd" / "\x1b[31m.png")
    (work / "loop").symlink_to("loop")
    (work / "dangling").symlink_to("nowhere/at/all")
    (work / "link").symlink_to("presses")


def _changed(words: list[str], rng: Random) -> list[str]:
    words = list(words) or [""]
    at = rng.randrange(1, len(words)) if len(words) > 1 else 0
    kind = rng.randrange(10)
    if kind < 5:
        valued = [k for k in range(1, len(words)) if not words[k].startswith("--")] or [0]
        at = rng.choice(valued)
        words[at] = _value(words[at], rng)
    elif kind == 5:
        del words[at]
    elif kind == 6:
        words[at:at] = [rng.choice(_OPTIONS), _value("", rng)]
    elif kind == 7:
        words.append(rng.choice(_OPTIONS))
    elif kind == 8:
        words += words[at : at + 2]
    else:
        words[0] = rng.choice(("run", "calibrate", "new", "simulate", "validate", "doctor"))
    return words


def _value(was: str, rng: Random) -> str:
    if was.replace(".", "").isdigit() or rng.random() < 0.25:
        return word_of(rng.choice(NUMBERS))
    return rng.choice(PATHS) if rng.random() < 0.6 else rng.choice(WORDS)


def _safe(words: list[str]) -> list[str]:
    """Remove NUL, which no shell can pass, and an ``--out`` outside the sandbox."""
    kept = [word.replace("\x00", "") for word in words]
    for at, word in enumerate(kept[1:], 1):
        if word.startswith(("/", "~", "--out=")) and kept[at - 1] == "--out":
            kept[at] = "out"
    return kept
