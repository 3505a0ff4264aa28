"""MCAP recordings that are damaged on purpose, and what of them must come back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from support.recordings import SESSION, image

from tactile_core.interfaces.recording_format import ImageEntry
from tactile_core.interfaces.recording_writer import RecordedImage
from tactile_core.interfaces.streaming.encoded_image import EncodedImage
from tactile_core.quantities import Image, Reference
from tactile_core.recordings.mcap.records import CHUNK, RECORD
from tactile_core.recordings.mcap.writer import McapWriter
from tactile_core.recordings.source import recording_file

Images = dict[int, tuple[bytes, dict[str, object]]]
"""Pixels and description of each image, by its number."""


def record(path: Path, *, images: int = 60, finished: bool = True, bundle: bool = True) -> None:
    """Write a recording of raw and compressed images, with references and events between them."""
    rng = np.random.default_rng(1)
    pixels = rng.random((12, 16, 3), np.float32)
    files = {"manifest.json": b"{}", "light/model.npz": rng.bytes(3000)} if bundle else None
    session = replace(SESSION, bundle=files, reference=Reference(pixels, SESSION.channels))
    writer = McapWriter(path)
    writer.open(session)
    for number in range(images):
        one = image(number, sequence=number)
        sent: Image | EncodedImage = one
        if number % 2:
            jpeg = bytes(cv2.imencode(".jpg", one.pixels)[1])
            sent = EncodedImage(jpeg, "camera", one.timestamp_s, one.wall_time_s)
        writer.write_image(RecordedImage(sent, number))
        writer.write_event("measured", {"number": number, "tare": False})
        if number % 20 == 10:
            writer.write_reference(f"{number:04d}", Reference(pixels + number, SESSION.channels))
            writer.write_event("reference", {"name": f"{number:04d}"})
    writer.close() if finished else writer.abandon()


def images_in(path: Path) -> Images:
    """Read all images of a recording."""
    with recording_file(path) as file:
        return {
            entry.described["number"]: (file.image(entry).pixels.tobytes(), dict(entry.described))
            for entry in file.entries
            if isinstance(entry, ImageEntry)
        }


def chunks_in(data: bytes, sent: Images) -> Iterator[tuple[int, int, int]]:
    """Yield the number of each image, and the offsets of its chunk."""
    at, numbers = 8, iter(sorted(sent))
    while at + RECORD.size < len(data):
        kind, length = RECORD.unpack_from(data, at)
        end = at + RECORD.size + length
        if kind == CHUNK and b"/camera/info" in data[at:end]:
            yield next(numbers), at, end
        at = end


def damaged(data: bytes, first: int, last: int, mask: int) -> bytes:
    """Flip the bits of a mask in one byte, zero a range if it is 0, cut off there if below."""
    if mask < 0:
        return data[:first]
    middle = bytes([data[first] ^ mask]) if mask else bytes(last - first)
    return data[:first] + middle + data[last:]
