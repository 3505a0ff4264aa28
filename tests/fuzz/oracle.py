"""The promises for every input, checked after each attempt."""

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
"""Largest peak memory of a process above its start, MiB."""

_LONGEST_MESSAGE = 6000
"""Longest allowed message, characters."""

_NOISE = re.compile(
    r"Traceback \(most|Exception ignored|Warning: |\[ ?(?:WARN|ERROR|INFO)[: ]|^\[\w+ @ 0x|libpng|"
    r"libjpeg|Corrupt JPEG|Premature end|OpenCV[(:]|TIFF(?:Read|Fetch|Open)|Fatal Python",
    re.MULTILINE,
)
_MESSAGE = re.compile(r"^(?:tactile: |Error: )|^Usage: (?=.*\n(?!Try))", re.MULTILINE)
"""Matches messages; a wrong call also prints its usage, an empty call only that."""
_BUG = re.compile("this is a bug(?! of its author)")
"""Matches a message about a bug of ours; that of a plugin belongs to its author."""
_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e]")
_ALLOWED = frozenset({"TactileError", "ValueError", "TypeError", "ValidationError"})


def broken_promises(
    attempt: Attempt, before: Mapping[str, str], box: Sandbox, outcomes: list[Outcome]
) -> Iterator[str]:
    """Yield each broken promise, with the same text for the same fault."""
    for outcome in outcomes:
        if attempt.signal is not None and _before_our_code(outcome):
            continue
        if "harness" in outcome.report:
            yield f"the harness failed: {outcome.report['harness']}"
        yield from _of_the_process(attempt, outcome)
        if attempt.call is not None:
            yield from _of_the_call(outcome)
        elif not outcome.hung and outcome.code >= 0:
            yield from _of_the_output(attempt, outcome)
            yield from attempt.judge(outcome)
    yield from _of_the_files(attempt, before, box, outcomes)
    out = attempt.out
    killed = any(outcome.hung or outcome.code == -signal.SIGKILL for outcome in outcomes)
    if out is not None and attempt.call is None:
        yield from _of_the_results(attempt, box, out, killed)


def _before_our_code(outcome: Outcome) -> bool:
    """Return whether a signal came while the interpreter was starting."""
    stderr = _text(outcome.stderr)
    return "Fatal Python error: init" in stderr or (
        "KeyboardInterrupt" in stderr and "tactile_core" not in stderr
    )


def _of_the_process(attempt: Attempt, outcome: Outcome) -> Iterator[str]:
    if outcome.hung:
        yield "hangs: blocked" if outcome.cpu_s < 2 else "hangs: works for more than 10 s"
    elif outcome.code not in attempt.codes and not _left_some_out(outcome):
        yield f"exit {outcome.code}: {message_of(outcome)}"
    if outcome.peak_mib > MEMORY_MIB:
        yield "uses more than 1 GiB"


def _left_some_out(outcome: Outcome) -> bool:
    """Return whether the command measured some of several recordings, and names the others."""
    return outcome.code == 1 and "could not be measured and are left out:" in _text(outcome.stderr)


def _of_the_call(outcome: Outcome) -> Iterator[str]:
    if "raised" not in outcome.report:
        return
    kind, message, place, kinds = outcome.report["raised"]
    if not _ALLOWED & set(kinds):
        yield f"{kind} from {place}: {plain(message)}"
    elif not message.strip():
        yield f"{kind} from {place} without a message"
    elif (
        "ValidationError" not in kinds and "Error" not in kinds and len(message) > _LONGEST_MESSAGE
    ):
        yield f"{kind} from {place} has an overlong message"
    noise = _NOISE.search(_text(outcome.stderr))
    if noise:
        yield f"noise on stderr: {plain(_line_at(_text(outcome.stderr), noise.start()))}"


def _of_the_output(attempt: Attempt, outcome: Outcome) -> Iterator[str]:
    stderr, data = _text(outcome.stderr), _text(outcome.stdout)
    if noise := _NOISE.search(stderr):
        yield f"noise on stderr: {plain(_line_at(stderr, noise.start()))}"
    if _BUG.search(stderr) and not all(name in stderr for name in attempt.named or ("\x00",)):
        yield f"this is a bug: {outcome.report.get('place', plain(stderr))}"
    count = len(_MESSAGE.findall(stderr))
    several = attempt.words[:1] == ["validate"]
    # the problems that doctor finds are its data, on stdout
    readable = not attempt.wires.startswith("stderr") and attempt.words[:1] != ["doctor"]
    if outcome.code in (1, 2) and readable and (count == 0 or (count > 1 and not several)):
        yield f"{'no' if not count else 'more than one'} message with exit {outcome.code}"
    if outcome.code in (1, 2) and readable and attempt.named:
        missing = [name for name in attempt.named if name not in stderr]
        if missing:
            yield f"the message does not name {missing[0]}: {plain(stderr)[:160]}"
    if len(stderr) > _LONGEST_MESSAGE and not several:
        yield f"an overlong message: {plain(stderr)[:80]}"
    for text, stream in ((stderr, "stderr"), (data, "stdout")):
        if _UNPRINTABLE.search(text.replace("\r", "")):
            yield f"control characters on {stream}: {attempt.words[:1]}"
    if "tactile: " in data or _BUG.search(data):
        yield "an error on stdout"
    # with a full stderr no message can be printed, but the work is done
    ended = outcome.code in (0, 130) or not readable
    if not ended and data.strip() and attempt.words[0] not in _STREAMING:
        yield f"output on stdout with exit {outcome.code}: {attempt.words[0]}"
    if _is_flag("--json", attempt.words) and "--help" not in attempt.words:
        yield from _of_the_json(attempt, data)


def _is_flag(name: str, words: list[str]) -> bool:
    """Return whether a word is given as a flag, not as the value of the option before it."""
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
            yield f"stdout is not JSON: {plain(str(error))}"
            return


def _refused(name: str) -> Any:
    raise ValueError(f"{name} is not JSON")


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
    """Return whether a hidden result has the name of a hidden input."""
    stem = Path(name).name.rpartition(".")[0].removesuffix("_normals")
    return any(Path(other).name.rpartition(".")[0] == stem for other in before) or stem == ""


def _of_the_results(attempt: Attempt, box: Sandbox, out: Path, killed: bool) -> Iterator[str]:
    """Yield faults of the results in ``--out``."""
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
    """Return whether the command created the folder."""
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
    """Return the last line of stderr, without details of this case."""
    lines = [line for line in _text(outcome.stderr).splitlines() if line.strip()]
    return plain(lines[-1])[:160] if lines else "no message"


def plain(text: str) -> str:
    """Return a text without numbers, paths and quotations."""
    text = re.sub(r"\S*/\S*", "PATH", text)
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "'…'", text)
    return " ".join(re.sub(r"[-+]?\d[\d.e+]*", "N", text).split())[:200]


def _sort(name: str) -> str:
    """Return the kind of a file, without its name."""
    path = Path(name)
    return f"{path.parts[0]}/…{path.suffix or path.name[:1]}"


def _command(attempt: Attempt) -> str:
    return attempt.words[0] if attempt.words else "a call"


def _line_at(text: str, at: int) -> str:
    return text[at:].splitlines()[0][:160]


def _text(data: bytes) -> str:
    return data.decode("utf-8", "replace")
