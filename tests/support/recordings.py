"""Recordings of small sensors, and the arrays of what was measured."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.interfaces.recording_writer import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Image

Arrays = dict[str, np.ndarray[Any, Any]]
SESSION = RecordedSession(
    profile="schema: 1\nname: small\nimage: {width_px: 16, height_px: 12, mm_per_px: 0.1}\n",
    sensor="small",
    channels=("red", "green", "blue"),
)


def arrays_of(reading: Reading) -> Arrays:
    """Return every array and number of a reading."""
    return {
        f"{kind.__name__}.{name}": np.asarray(array)
        for kind, quantity in reading.quantities.items()
        for name, array in quantity.arrays().items()
    }


def assert_equal(live: Iterable[Arrays], replayed: Iterable[Arrays]) -> None:
    """Check that two runs measured the same, bit for bit."""
    live, replayed = list(live), list(replayed)
    assert len(replayed) == len(live)
    for number, (one, other) in enumerate(zip(live, replayed, strict=True)):
        assert one.keys() == other.keys()
        for name in one:
            same = one[name].tobytes() == other[name].tobytes()
            assert same, f"{name} of reading {number} differs"


def image(number: int, **fields: Any) -> Image:
    """Return a small image, different for each number."""
    pixels = np.random.default_rng(number).integers(0, 256, (12, 16, 3), np.uint8)
    return Image(pixels, timestamp_s=0.1 * number, wall_time_s=1e9 + 0.1 * number, **fields)


def write(writer: RecordingWriter, count: int) -> list[Image]:
    """Write images of a streaming camera and return them."""
    writer.open(SESSION)
    images = [image(number, sequence=number) for number in range(count)]
    for number, one in enumerate(images):
        writer.write_image(RecordedImage(one, number))
    return images


def written(path: Path, count: int) -> list[Image]:
    """Write a whole recording in the format of the path's ending."""
    from tactile_core.recordings.source import recording_writer

    writer = recording_writer(path)
    images = write(writer, count)
    writer.close()
    return images
