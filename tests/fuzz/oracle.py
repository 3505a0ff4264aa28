"""What is promised whatever the input: checked after each attempt."""

from __future__ import annotations

import json
import os
import re
import signal
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from fuzz.attempt import Attempt
from fuzz.process import Outcome
from fuzz.sandbox import Sandbox

MEMORY_MIB = 1024.0
_LONGEST_MESSAGE = 6000
_NOISE = re.compile(
    r"Traceback \(most|Exception ignored|Warning: |\[ ?(?:WARN|ERROR|INFO)[: ]|^\[\w+ @ 0x|libpng|"
    r"libjpeg|Corrupt JPEG|Premature end|OpenCV[(:]|TIFF(?:Read|Fetch|Open)|Fatal Python",
    re.MULTILINE,
)
_MESSAGE = re.compile(r"^(?:tactile: |Error: )|^Usage: (?=.*\n(?!Try))", re.MULTILINE)
"""A wrong call is shown with its usage, no call at all with that alone."""
_BUG = "this is a bug"
_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e]")
_ALLOWED = frozenset({"TactileError", "ValueError", "TypeError", "ValidationError"})


def broken_promises(
    attempt: Attempt, before: Mapping[str, str], box: Sandbox, outcomes: list[Outcome]
) -> Iterator[str]:
    """Say each promise that was not kept, the same words for the same fault."""
    for outcome in outcomes:
        if attempt.signal is not None and _before_our_code(outcome):
            continue
        if "harness" in outcome.report:
            yield f"the harness failed: {outcome.report['harness']}"
        yield from _of_the_process(attempt, outcome)
        if attempt.call is not None:
            yield from _of_the_call(outcome)
        elif not outcome.hung and outcome.code >= 0:
            yield from _of_the_words(attempt, outcome)
    yield from _of_the_files(attempt, before, box, outcomes)
    out = attempt.out
    killed = any(outcome.hung or outcome.code == -signal.SIGKILL for outcome in outcomes)
    if out is not None and attempt.call is None:
        yield from _of_the_results(attempt, box, out, killed)


def _before_our_code(outcome: Outcome) -> bool:
    """Whether a signal came while the interpreter itself was starting."""
    said = _text(outcome.stderr)
    return "Fatal Python error: init" in said or (
        "KeyboardInterrupt" in said and "tactile_core" not in said
    )


def _of_the_process(attempt: Attempt, outcome: Outcome) -> Iterator[str]:
    if outcome.hung:
        yield "hangs: blocked" if outcome.cpu_s < 2 else "hangs: works on for more than 10 s"
    elif outcome.code not in attempt.codes:
        yield f"exit {outcome.code}: {message_of(outcome)}"
    if outcome.peak_mib > MEMORY_MIB:
        yield "takes more than 1 GiB"


def _of_the_call(outcome: Outcome) -> Iterator[str]:
    if "raised" not in outcome.report:
        return
    kind, message, place, kinds = outcome.report["raised"]
    if not _ALLOWED & set(kinds):
        yield f"{kind} from {place}: {plain(message)}"
    elif not message.strip():
        yield f"{kind} from {place} without a word"
    elif (
        "ValidationError" not in kinds and "Error" not in kinds and len(message) > _LONGEST_MESSAGE
    ):
        yield f"{kind} from {place} has a message without end"
    noise = _NOISE.search(_text(outcome.stderr))
    if noise:
        yield f"noise on stderr: {plain(_line_at(_text(outcome.stderr), noise.start()))}"


def _of_the_words(attempt: Attempt, outcome: Outcome) -> Iterator[str]:
    said, data = _text(outcome.stderr), _text(outcome.stdout)
    if noise := _NOISE.search(said):
        yield f"noise on stderr: {plain(_line_at(said, noise.start()))}"
    if _BUG in said and not all(name in said for name in attempt.named or ("\x00",)):
        yield f"this is a bug: {outcome.report.get('place', plain(said))}"
    count = len(_MESSAGE.findall(said))
    several = attempt.words[:1] == ["validate"]
    # what doctor finds is what it was asked for
    heard = not attempt.wires.startswith("stderr") and attempt.words[:1] != ["doctor"]
    if outcome.code in (1, 2) and heard and (count == 0 or (count > 1 and not several)):
        yield f"{'no' if not count else 'more than one'} message with exit {outcome.code}"
    if outcome.code in (1, 2) and heard and attempt.named:
        missing = [name for name in attempt.named if name not in said]
        if missing:
            yield f"the message does not name {missing[0]}: {plain(said)[:160]}"
    if len(said) > _LONGEST_MESSAGE and not several:
        yield f"a message without end: {plain(said)[:80]}"
    for text, stream in ((said, "stderr"), (data, "stdout")):
        if _UNPRINTABLE.search(text.replace("\r", "")):
            yield f"control characters on {stream}: {attempt.words[:1]}"
    if "tactile: " in data or _BUG in data:
        yield "an error on stdout"
    # nothing is heard where stderr is full, and the work is done
    ended = outcome.code in (0, 130) or not heard
    if not ended and data.strip() and attempt.words[0] not in _STREAMING:
        yield f"words on stdout with exit {outcome.code}: {attempt.words[0]}"
    if _is_flag("--json", attempt.words) and "--help" not in attempt.words:
        yield from _of_the_json(attempt, data)


def _is_flag(name: str, words: list[str]) -> bool:
    """Whether a word stands for itself and is not the value of the option before it."""
    flags = {"--json", "--sim", "--plugin", "--force"}
    pairs = zip(["", *words], words, strict=False)
    return any(word == name and (not last.startswith("-") or last in flags) for last, word in pairs)


_STREAMING = frozenset({"run", "validate", "doctor"})


def _of_the_json(attempt: Attempt, data: str) -> Iterator[str]:
    lines = data.splitlines() if attempt.words[0] == "run" else [data] if data.strip() else []
    for line in lines:
        try:
            json.loads(line, parse_constant=_refused)
        except ValueError as error:
            yield f"stdout is no JSON: {plain(str(error))}"
            return


def _refused(name: str) -> Any:
    raise ValueError(f"{name} is no JSON")


def _of_the_files(
    attempt: Attempt, before: Mapping[str, str], box: Sandbox, outcomes: list[Outcome]
) -> Iterator[str]:
    after = box.listing()
    ours = tuple(str((box.work / path).relative_to(box.root)) for path in attempt.ours)
    for name, was in before.items():
        if any(name == mine or name.startswith(f"{mine}/") for mine in ours):
            continue
        if name not in after:
            yield f"the user's {_sort(name)} is gone: {_command(attempt)}"
        elif after[name] != was:
            yield f"the user's {_sort(name)} was overwritten: {_command(attempt)}"
    killed = attempt.may_litter or any(outcome.hung for outcome in outcomes)
    fresh = [name for name in after if name not in before]
    litter = [n for n in fresh if Path(n).name.startswith((".", "tmp")) or n.startswith("tmp/")]
    litter = [name for name in litter if not _meant(name, before)]
    if litter and not killed:
        yield f"left behind: {_sort(litter[0])}, by {_command(attempt)}"
    refused = all(outcome.code == 2 for outcome in outcomes) and attempt.call is None
    results = [name for name in fresh if not name.startswith("home/") and name not in litter]
    if refused and results and attempt.words[:1] != ["run"]:
        yield f"refused, but something was written: {_sort(results[0])}, by {_command(attempt)}"


def _meant(name: str, before: Mapping[str, str]) -> bool:
    """Whether a hidden result only follows a hidden input's or option's name."""
    stem = Path(name).name.rpartition(".")[0].removesuffix("_normals")
    return any(Path(other).name.rpartition(".")[0] == stem for other in before) or stem == ""


def _of_the_results(attempt: Attempt, box: Sandbox, out: Path, killed: bool) -> Iterator[str]:
    """What stands under ``--out`` is whole."""
    place = box.work / out
    try:
        if not place.is_dir() or not _was_made(attempt, place, box):
            return
    except (OSError, ValueError):
        return
    command = attempt.words[0]
    if command == "calibrate" and not attempt.plugins:
        yield from _of_the_bundle(place)
    elif command == "run":
        for path in place.rglob("*"):
            yield from _of_the_file(path)
    elif command == "simulate" and not killed:
        frames, truths = list((place / "frames").glob("*")), list((place / "truth").glob("*.npz"))
        if len(frames) != len(truths) or not frames or not (place / "reference").is_dir():
            yield "half a recording was written by simulate"


def _was_made(attempt: Attempt, place: Path, box: Sandbox) -> bool:
    """Whether the folder belongs to the command rather than to the user."""
    mine = {os.path.realpath(box.work / path) for path in attempt.ours}
    real = os.path.realpath(place)
    return real in mine or real not in box.given


def _of_the_bundle(place: Path) -> Iterator[str]:
    from tactile_core.bundles.bundle import Bundle

    try:
        Bundle.load(place)
    except Exception as error:
        yield f"the bundle written does not load: {plain(str(error))}"


def _of_the_file(path: Path) -> Iterator[str]:
    from tactile_core.formats.images import read_image
    from tactile_core.formats.npz import read_npz
    from tactile_core.formats.tmd import read_tmd

    reader: Any = {".npz": read_npz, ".tmd": read_tmd, ".png": read_image}.get(path.suffix)
    if reader is None or not path.is_file():
        return
    try:
        content = reader(path)
    except Exception as error:
        yield f"half-written {path.suffix}: {plain(str(error))}"
        return
    if path.suffix == ".npz":
        for name, array in content.items():
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                yield f"not finite in the results: {name}"


def message_of(outcome: Outcome) -> str:
    """The last line of stderr, without what is of this case alone."""
    lines = [line for line in _text(outcome.stderr).splitlines() if line.strip()]
    return plain(lines[-1])[:160] if lines else "no message"


def plain(text: str) -> str:
    """Words without numbers, paths and what is quoted."""
    text = re.sub(r"\S*/\S*", "PATH", text)
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "'…'", text)
    return " ".join(re.sub(r"[-+]?\d[\d.e+]*", "N", text).split())[:200]


def _sort(name: str) -> str:
    """What sort of file it is, whatever it is called."""
    path = Path(name)
    return f"{path.parts[0]}/…{path.suffix or path.name[:1]}"


def _command(attempt: Attempt) -> str:
    return attempt.words[0] if attempt.words else "a call"


def _line_at(text: str, at: int) -> str:
    return text[at:].splitlines()[0][:160]


def _text(data: bytes) -> str:
    return data.decode("utf-8", "replace")
