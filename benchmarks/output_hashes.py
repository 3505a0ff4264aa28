"""Hashes of every command's outputs, to show that a refactoring changes no byte of them.

Run it with the interpreter of each version, once before and once after the change:

``python benchmarks/output_hashes.py --out before``
    runs the command lines of ``output_cases.yaml`` in a fresh folder with the ``tactile`` of the
    same installation. It writes ``before/hashes.json`` (case, output, SHA-256) and the hashed
    outputs. Recordings come from ``TACTILE_TEST_DATA``; the default is ``shared/data`` in the
    parent folder of this checkout.
``python benchmarks/output_hashes.py --compare before after``
    lists all differences with their largest value, and exits with 1 if there are any.

Only the public interface is used: commands, files, and the few Python names that scripts rely on.
Binary files are hashed unchanged. Varying parts of texts are removed first: see `UNSTEADY`,
`TIMED_TABLE`, `UNSTEADY_KEYS`, `IMPORT` and `ONLY_KEYS`, each with its reason.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[1]
CASES = Path(__file__).with_name("output_cases.yaml")
DATA = Path(os.environ.get("TACTILE_TEST_DATA", ROOT.parent / "shared" / "data")).resolve()
HASHES = "hashes.json"
TEXTS = {".csv", ".html", ".json", ".md", ".py", ".toml", ".txt", ".yaml", ""}

UNSTEADY = {
    r"\b[\d.]+(?= ?ms\b)": "TIME",
    r"\b[\d.]+(?= ?MiB\b)": "MEMORY",
    r"[\d.]+ / [\d.]+(\s+|</td><td>)\d+(?=$|</td></tr>)": "TIME MEMORY",
}
"""Processing time of a frame and memory of the process; the last two columns of a table."""

TIMED_TABLE = "time, ms (median / p90)"
"""Header of a table whose column widths depend on its times."""

UNSTEADY_KEYS = {
    "latency_ms",  # processing time of a frame
    "timed_frames",  # number of frames in a fixed time
    "peak_memory_mib",  # of the process
    "created",  # when a bundle was written
    "versions",  # of the software that wrote it
    "machine",  # on which a bench ran
    "content_hash",  # of a manifest, with its date
    "mtime_ns",  # when a result was written, in the folder's list of results
    "size",  # in the same list, of a report that contains times; every file is hashed anyway
}
"""Keys of JSON objects whose values depend on the time or the machine."""

IMPORT = re.compile(r"^\s*(from|import) tactile_core.*\n", re.MULTILINE)
"""Lines of a scaffold that import modules of the core, which a refactoring may move."""

ONLY_KEYS = {"bench"}
"""Cases whose JSON contains only measured times: only its keys and texts are compared."""

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
STEADY_ENVIRONMENT = {
    "COLUMNS": "100",
    "LC_ALL": "C.UTF-8",
    "NO_COLOR": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "TERM": "dumb",
}

Hashes = dict[str, dict[str, str]]


def main() -> None:
    """Write hashes, or compare two folders of them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, metavar="DIR", help="run all cases and write hashes")
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("BEFORE", "AFTER"))
    parser.add_argument(
        "--only", action="append", metavar="CASE", help="with the cases that it depends on"
    )
    options = parser.parse_args()
    if bool(options.out) == bool(options.compare):
        parser.error("give either --out or --compare")
    if options.compare:
        sys.exit(compare(*options.compare))
    write(options.out, options.only)


def write(out: Path, only: list[str] | None = None) -> None:
    """Run the cases, and write their outputs and hashes."""
    if out.exists() and any(out.iterdir()):
        sys.exit(f"{out} is not empty; give a new folder")
    plan = YAML(typ="safe").load(CASES)
    hashes: Hashes = {}
    began = time.monotonic()
    with TemporaryDirectory(prefix="tactile-hashes-") as name:
        work = Path(name).resolve()
        prepare(work, plan)
        for case, lines in cases(plan["cases"]):
            if only and case not in only:
                continue
            start = time.monotonic()
            exits = [run(work, case, number, line) for number, line in enumerate(lines)]
            hashes[case] = collect(work, case, out / case)
            summary = f"{len(hashes[case])} outputs, exit {' '.join(map(str, exits))}"
            print(f"{time.monotonic() - start:6.1f} s  {case}: {summary}", flush=True)
    text = json.dumps(hashes, indent=1, sort_keys=True, ensure_ascii=False)
    (out / HASHES).write_text(text + "\n", encoding="utf-8")
    total = sum(map(len, hashes.values()))
    print(f"{len(hashes)} cases, {total} outputs, {time.monotonic() - began:.0f} s")


def prepare(work: Path, plan: dict[str, Any]) -> None:
    """Create the files and folders that the command lines use."""
    (work / "data").symlink_to(DATA)
    (work / "home").mkdir()
    for name, text in plan["files"].items():
        (work / name).write_text(text, encoding="utf-8")
    for path in plan["copies"]:
        shutil.copy(ROOT / path, work)
    for name, patterns in plan["subsets"].items():
        (work / name).mkdir()
        for path in sorted(path for pattern in patterns for path in DATA.glob(pattern)):
            shutil.copy(path, work / name)


def cases(listed: dict[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """Each case's name and command lines, with ``each`` expanded."""
    for name, entry in listed.items():
        if isinstance(entry, list):
            yield name, entry
            continue
        for value in entry["each"]:
            yield f"{name}_{value}", [line.replace("{each}", value) for line in entry["run"]]


def run(work: Path, case: str, number: int, line: str) -> int:
    """Run one command line, and keep its printed output with its files."""
    out = work / case
    out.mkdir(exist_ok=True)
    words = shlex.split(line.format(data="data", out=case))
    own = dict(words.pop(0).split("=", 1) for _ in range(len(words)) if "=" in words[0])
    tactile = str(Path(sys.executable).with_name("tactile"))
    program = {"tactile": tactile, "python": sys.executable}
    home = {"HOME": str(work / "home"), "XDG_DATA_HOME": str(work / "home")}
    done = subprocess.run(
        [program[words[0]], *words[1:]],
        cwd=work,
        env=os.environ | STEADY_ENVIRONMENT | home | own,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    (out / f"stdout.{number}").write_bytes(done.stdout)
    (out / f"stderr.{number}").write_bytes(done.stderr)
    (out / f"exit.{number}").write_text(f"{done.returncode}\n")
    return done.returncode


def collect(work: Path, case: str, into: Path) -> dict[str, str]:
    """Hash a case's outputs, and keep them in the form that is hashed."""
    hashes = {}
    for path in sorted(path for path in (work / case).rglob("*") if path.is_file()):
        name = path.relative_to(work / case).as_posix()
        content = path.read_bytes()
        if is_text(name):
            content = steady(content.decode(), work, only_keys=case in ONLY_KEYS).encode()
        (into / name).parent.mkdir(parents=True, exist_ok=True)
        (into / name).write_bytes(content)
        hashes[name] = hashlib.sha256(content).hexdigest()
    return hashes


def is_text(name: str) -> bool:
    """Whether an output is text, by its name."""
    return name.startswith(("stdout.", "stderr.", "exit.")) or Path(name).suffix in TEXTS


def steady(text: str, work: Path, *, only_keys: bool = False) -> str:
    """Replace the parts of a text that vary between runs or installations."""
    for folder, word in ((work, "WORK"), (DATA, "DATA"), (_installed(), "CODE")):
        text = text.replace(str(folder), word)
    try:
        objects = [json.loads(text)]
    except ValueError:
        try:
            objects = [json.loads(line) for line in text.splitlines()]
        except ValueError:
            objects = []
    if any(isinstance(each, dict) for each in objects):
        kept = [_steady_json(each, only_keys) for each in objects]
        text = "".join(json.dumps(each, indent=1, ensure_ascii=False) + "\n" for each in kept)
    for pattern, word in UNSTEADY.items():
        text = re.sub(pattern, word, text, flags=re.MULTILINE)
    if TIMED_TABLE in text:
        text = re.sub(r"(?<=\S) {2,}", "  ", text)
    return IMPORT.sub("", text)


def _installed() -> Path:
    found = find_spec("tactile_core")
    if found is None or found.origin is None:
        sys.exit(f"{sys.executable} has no tactile_core; run with the interpreter that has it")
    return Path(found.origin).parents[1]


def _steady_json(value: Any, only_keys: bool) -> Any:
    if isinstance(value, dict):
        kept = {key: each for key, each in value.items() if key not in UNSTEADY_KEYS}
        return {key: _steady_json(each, only_keys) for key, each in kept.items()}
    if isinstance(value, list):
        return [_steady_json(each, only_keys) for each in value]
    return "NUMBER" if only_keys and isinstance(value, (int, float)) else value


def compare(before: Path, after: Path) -> int:
    """Print the differences between two folders of outputs; return 1 if there are any, else 0."""
    old, new = (_flat(json.loads((each / HASHES).read_text("utf-8"))) for each in (before, after))
    both = old.keys() & new.keys()
    differing = sorted(name for name in both if old[name] != new[name])
    print(f"identical: {len(both) - len(differing)} of {len(old.keys() | new.keys())} outputs")
    for word, names in (("missing", old.keys() - new.keys()), ("added", new.keys() - old.keys())):
        for name in sorted(names):
            print(f"{word}: {name}")
    for name in differing:
        print(f"differs: {name}: {difference(before / name, after / name)}")
    return int(old != new)


def _flat(hashes: Hashes) -> dict[str, str]:
    return {
        f"{case}/{name}": each for case, found in hashes.items() for name, each in found.items()
    }


def difference(before: Path, after: Path) -> str:
    """Describe the largest difference of two outputs."""
    if before.suffix == ".npz":
        return _of_arrays(_arrays(before), _arrays(after))
    if before.suffix == ".png":
        import cv2

        old, new = (cv2.imread(str(each), cv2.IMREAD_UNCHANGED) for each in (before, after))
        return _of_arrays({"pixels": np.asarray(old)}, {"pixels": np.asarray(new)})
    if not is_text(before.name):
        return f"{before.stat().st_size} and {after.stat().st_size} bytes"
    old_text, new_text = before.read_text("utf-8"), after.read_text("utf-8")
    if NUMBER.sub("#", old_text) == NUMBER.sub("#", new_text):
        values = [np.array(NUMBER.findall(text), float) for text in (old_text, new_text)]
        return f"only numbers, by {_largest(*values)}"
    pairs = zip(old_text.splitlines(), new_text.splitlines(), strict=False)
    first = next(((a, b) for a, b in pairs if a != b), ("one is", "longer than the other"))
    return " | ".join(line.strip()[:120] for line in first)


def _arrays(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    with np.load(path) as arrays:
        return {name: arrays[name] for name in arrays.files}


def _of_arrays(old: dict[str, np.ndarray[Any, Any]], new: dict[str, np.ndarray[Any, Any]]) -> str:
    notes = [f"{name} only in one" for name in sorted(old.keys() ^ new.keys())]
    for name in sorted(old.keys() & new.keys()):
        a, b = old[name], new[name]
        if (a.shape, a.dtype) != (b.shape, b.dtype):
            notes.append(f"{name} {a.dtype}{a.shape} and {b.dtype}{b.shape}")
        elif a.tobytes() != b.tobytes():
            notes.append(f"{name} {'differs' if a.dtype.kind in 'USO' else _largest(a, b)}")
    return ", ".join(notes) or "equal arrays in different files"


def _largest(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> str:
    difference = np.abs(a.astype(np.float64) - b.astype(np.float64))
    finite = difference[np.isfinite(difference)]
    return f"{finite.max() if finite.size else np.nan:.3g}"


if __name__ == "__main__":
    main()
