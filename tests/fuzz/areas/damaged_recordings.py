"""Single flipped bits, zeroed halves and truncations of recordings and bundles."""

from __future__ import annotations

import shutil
from pathlib import Path
from random import Random

from fuzz import recipes
from fuzz.attempt import Attempt, Corrupt
from fuzz.sandbox import Sandbox


def damaged(box: Sandbox, rng: Random) -> Attempt:
    """Return a command or a call that reads a damaged recording or bundle."""
    if rng.random() < 0.3:
        files = sorted(file for file in (box.work / "bundle").rglob("*") if file.suffix == ".npz")
        return Attempt(list(recipes.RUN), corrupt=_damage(rng.choice(files)), codes=frozenset({2}))
    if rng.random() < 0.5:
        whole = box.work / "whole.mcap"
        shutil.copy(box.work / "tape.mcap", whole)
        return Attempt(
            call=lambda: _compare(Path("tape.mcap"), whole), corrupt=_damage(box.work / "tape.mcap")
        )
    words, name = rng.choice(
        (
            (recipes.RUN_MCAP, "tape.mcap"),
            (recipes.CONVERT, "tape.mcap"),
            (recipes.RECOVER, "tape.mcap"),
            (recipes.RUN_HDF5, "tape.h5"),
            (recipes.CONVERT_HDF5, "tape.h5"),
            (recipes.RUN_FOLDER, "tape/recording.jsonl"),
        )
    )
    return Attempt(list(words), corrupt=_damage(box.work / name))


def _damage(path: Path) -> Corrupt:
    def corrupt(rng: Random) -> None:
        data = bytearray(path.read_bytes())
        at = rng.randrange(len(data))
        kind = rng.random()
        if kind < 0.7:
            data[at] ^= 1 << rng.randrange(8)
        elif kind < 0.85:
            half = len(data) // 2
            at = rng.randrange(len(data) - half)
            data[at : at + half] = bytes(half)
        else:
            del data[at:]
        path.write_bytes(data)

    return corrupt


class Altered(Exception):
    """A damaged image came back as a good one."""


def _compare(damaged: Path, whole: Path) -> None:
    from support.damaged_recordings import images_in

    sent = images_in(whole)
    for number, image in images_in(damaged).items():
        if image != sent[number]:
            raise Altered("an image of a damaged recording is not the one that was recorded")
