"""Small synthetic readings, and the files that the core's sinks write for them."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sinks import Sinks
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    Gradients,
    HeightMap,
    MarkerField,
    Quantity,
)
from tactile_core.recordings.output_folder import OutputFolder

SHAPE = (6, 8)
ONES = np.ones(SHAPE, bool)


def reading(*quantities: Quantity, source: str = "press.v1") -> Reading:
    frame = Frame(np.zeros((*SHAPE, 3), np.uint8), ("r", "g", "b"), 0.1, source=source)
    return Reading(frame, {type(q): q for q in quantities}, {})


def slopes(fill: float = 0.1) -> Gradients:
    return Gradients(np.full(SHAPE, fill, np.float32), np.zeros(SHAPE, np.float32), ONES, 0.1)


def height(fill: float = 0.5, valid: Any = ONES) -> HeightMap:
    return HeightMap(np.full(SHAPE, fill, np.float32), valid, 0.1)


def contact() -> ContactMask:
    return ContactMask(ONES, 0.1)


def markers() -> MarkerField:
    at = np.array([[2, 2], [5, 2]], np.float32)
    return MarkerField(np.arange(2, dtype=np.int32), at, at + 1, np.array([True, False]), 0.1)


def shear() -> DisplacementField:
    return DisplacementField(np.full((*SHAPE, 2), 0.1, np.float32), ONES, 0.1)


def saved(taken: Reading, folder: OutputFolder | Path, names: Collection[str]) -> list[Path]:
    """Let sinks write a reading; return the files that are new or changed."""
    out = folder if isinstance(folder, OutputFolder) else OutputFolder(folder)
    before = _stamps(out.path)
    pipeline = Pipeline(load_profile("hex_fingertip"))
    with Sinks(pipeline.profile, names).open(pipeline, out) as sinks:
        sinks.write(taken)
    hidden = {path for path in out.path.iterdir() if path.name.startswith(".")}
    return sorted(
        p for p, stamp in _stamps(out.path).items() if before.get(p) != stamp and p not in hidden
    )


def _stamps(folder: Path) -> dict[Path, int]:
    return {p: p.stat().st_mtime_ns for p in folder.iterdir()} if folder.is_dir() else {}
