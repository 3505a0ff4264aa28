"""One mutation of one file or folder, depending on its kind."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random

from fuzz.arrays import corrupted_npz
from fuzz.pictures import corrupted_image
from fuzz.trees import corrupted_csv, corrupted_json, corrupted_lines, corrupted_yaml

Texts = Callable[[str, Random], str]
_TEXTS: dict[str, Texts] = {
    ".yaml": corrupted_yaml,
    ".json": corrupted_json,
    ".csv": corrupted_csv,
    ".stl": corrupted_lines,
}
_IMAGES = frozenset({".png", ".jpg"})
_UNUSUAL_NAMES = (
    *("a.png", "A.PNG", "press_0.jpg", ".hidden.png", "Thumbs.db", "x\ny.png", "\x1b[31m.png"),
    *(
        "a b.png",
        "é.png",
        "000000.png",
        "scan.yaml",
        "~.png",
        "#1.png",
        "press_00.png",
        "a" * 251 + ".png",
    ),
)


def corrupt(path: Path, rng: Random) -> None:
    """Change a file or folder in one way."""
    if not path.parent.is_dir():  # displaced before
        return
    if path.is_dir() and not path.is_symlink():
        corrupt_folder(path, rng)
    elif not path.is_file() or rng.random() < 0.05:
        displace(path, rng)
    else:
        data = path.read_bytes()
        path.write_bytes(_corrupted(data, path.suffix, rng))


def corrupt_folder(folder: Path, rng: Random) -> None:
    """Change the content of a folder, or one of its files."""
    if not folder.is_dir():  # displaced before
        displace(folder, rng)
        return
    inside = sorted(path for path in folder.rglob("*") if path.is_file())
    kind = rng.randrange(9)
    if kind < 3 and inside:
        corrupt(rng.choice(inside), rng)
    elif kind == 3 and inside:
        rng.choice(inside).unlink()
    elif kind == 4 and inside:
        with suppress(OSError):  # a folder has that name already
            shutil.copy(rng.choice(inside), folder / rng.choice(_UNUSUAL_NAMES))
    elif kind == 5:
        with suppress(FileExistsError):
            (folder / rng.choice(_UNUSUAL_NAMES)).mkdir()
    elif kind == 6:
        with_bytes = os.fsencode(folder) + b"/\xff\xfe.png"
        Path(os.fsdecode(with_bytes)).write_bytes(inside[0].read_bytes() if inside else b"")
    elif kind == 7 and inside:
        one = rng.choice(inside)
        one.rename(one.with_name(rng.choice(_UNUSUAL_NAMES)))
    else:
        displace(rng.choice([*inside, folder]), rng)


def displace(path: Path, rng: Random) -> None:
    """Replace a file by nothing, a folder, a pipe, a link or an empty file."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
    kind = rng.randrange(7)
    if kind == 0:
        path.mkdir()
    elif kind == 1:
        os.mkfifo(path)
    elif kind == 2:
        path.symlink_to(path.name)
    elif kind == 3:
        path.symlink_to("/dev/zero")
    elif kind == 4:
        path.write_bytes(b"")
    elif kind == 5:
        path.symlink_to("nowhere")


def _corrupted(data: bytes, suffix: str, rng: Random) -> bytes:
    if suffix == ".npz" and rng.random() < 0.7:
        return corrupted_npz(data, rng)
    if suffix in _IMAGES and rng.random() < 0.75:
        return corrupted_image(data, rng)
    if suffix in _TEXTS and rng.random() < 0.85:
        try:
            text = _TEXTS[suffix](data.decode(), rng)
        except (ValueError, RecursionError):
            return corrupted_bytes(data, rng)
        coding = rng.choice(("utf-16", "latin-1")) if rng.random() < 0.04 else "utf-8"
        return text.encode(coding, "surrogateescape" if coding == "utf-8" else "replace")
    return corrupted_bytes(data, rng)


def corrupted_bytes(data: bytes, rng: Random) -> bytes:
    """Return the bytes with a few changed, removed, repeated or added."""
    changed = bytearray(data)
    if not changed:
        return bytes(rng.randrange(256) for _ in range(rng.choice((1, 16, 400))))
    # changes in headers have the largest effect: half of them are among the first bytes
    size = len(changed) if rng.random() < 0.5 else min(len(changed), 96)
    at = rng.randrange(size)
    length = rng.choice((1, 1, 2, 4, 8, 64))
    kind = rng.randrange(8)
    if kind == 0:
        changed[at] ^= 1 << rng.randrange(8)
    elif kind == 1:
        changed[at : at + length] = bytes(rng.randrange(256) for _ in range(length))
    elif kind == 2:
        changed[at : at + 4] = rng.choice((0, 1, 2**31 - 1, 2**32 - 1, 1000)).to_bytes(4, "little")
    elif kind == 3:
        del changed[at:]
    elif kind == 4:
        del changed[at : at + length]
    elif kind == 5:
        changed[at:at] = changed[at : at + length]
    elif kind == 6:
        changed += bytes(rng.randrange(256) for _ in range(length))
    else:
        changed[at : at + length] = bytes(length)
    return bytes(changed)
