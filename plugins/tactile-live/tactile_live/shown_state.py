"""What the page shows of a sensor."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from tactile_core.acquisition.free_running import HOST
from tactile_core.errors import InputError
from tactile_core.formats.text import plain
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sinks import Sinks
from tactile_core.recordings.output_folder import OutputFolder
from tactile_live.commands import MessageParts
from tactile_live.live_sensor import LiveState, Sample
from tactile_live.pictures import layers_of, map_of, overlays, picture, titles


@dataclass(frozen=True)
class View:
    """What a page looks at.

    Attributes
    ----------
    maps : tuple of str
        Keys of the maps that are visible; without any, the first map there is.
    channel : int or None
        The light whose picture is wanted.
    """

    maps: tuple[str, ...] = ()
    channel: int | None = None


def encoded_state(state: LiveState, view: View, samples: Sequence[Sample]) -> bytes:
    """Return the message for a state.

    Parameters
    ----------
    state : LiveState
    view : View
    samples : sequence of Sample
        Numbers that the page does not have yet.
    """
    parts, reading, frame = MessageParts(), state.reading, state.frame
    layers, faults = layers_of(reading.quantities.values())
    there = titles(layers)
    wanted = [key for key in view.maps if any(key == one["key"] for one in there)]
    wanted = wanted or [one["key"] for one in there[:1]]
    header = {
        "number": state.number,
        "source": reading.source,
        "time_s": reading.frame.timestamp_s,
        "latency_ms": reading.latency_ms,
        "rate_hz": state.rate_hz,
        "relative": reading.relative,
        "size": [frame.pixels.shape[1], frame.pixels.shape[0]],
        "mm_per_px": frame.mm_per_px,
        "channels": list(frame.channels),
        "picture": picture(frame, view.channel, parts),
        "maps_there": there,
        "maps": [map_of(one, parts) for one in layers if one.key in wanted],
        "overlays": list(overlays(layers, frame.mm_per_px, parts)),
        "entries": [[one.key, one.title, one.unit, one.value] for one in state.entries],
        "featured": [one.key for one in state.entries if one.featured],
        "samples": _pack_samples(samples, parts),
        "warnings": [*reading.warnings, *state.faults, *faults],
        "health": state.health,
        "failure": state.failure,
    }
    header["age_ms"] = 1e3 * (HOST.now() - state.taken_s)
    return parts.message(plain(header))


def _pack_samples(samples: Sequence[Sample], parts: MessageParts) -> dict[str, Any]:
    keys = list(dict.fromkeys(key for sample in samples for key in sample.values))
    rows = np.full((len(samples), 1 + len(keys)), np.nan)
    for row, sample in zip(rows, samples, strict=True):
        row[0] = sample.taken_s
        for column, key in enumerate(keys, 1):
            row[column] = sample.values.get(key, np.nan)
    return {"keys": keys, "rows": parts.array(rows)}


SAVED = ("npz", "png")  # What a snapshot saves by default

_GIVEN: set[Path] = set()
_GIVING = Lock()


def new_path(out: Path, name: str, ending: str = "") -> Path:
    """Return a new path in the folder, never twice the same: time, name of the sensor, ending."""
    stem = f"{time.strftime('%Y-%m-%d_%H%M%S')}_{re.sub(r'[^A-Za-z0-9._-]', '_', name)}"
    path = out / f"{stem}{ending}"
    number = 1
    with _GIVING:
        while path.exists() or path in _GIVEN:
            number += 1
            path = out / f"{stem}_{number}{ending}"
        _GIVEN.add(path)
    return path


def save_snapshot(
    pipeline: Pipeline, reading: Reading, out: Path, name: str, sinks: Sequence[str] = SAVED
) -> Path:
    """Write the files of a reading to a new folder, and return the folder.

    Raises
    ------
    InputError
        A sink is unknown, or nothing was written.
    OSError
        The disk is full or not writable.
    """
    folder = OutputFolder(new_path(out, name))
    with Sinks(pipeline.profile, sinks).open(pipeline, folder) as opened:
        opened.write(reading)
    if not folder.path.is_dir():
        raise InputError("nothing of this reading can be saved; take a reference first")
    return folder.path
