"""Checks of recording formats."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np

from tactile_core.formats.images import decode_image
from tactile_core.interfaces.recording_format import (
    REFERENCE,
    EventEntry,
    RecordingFile,
    RecordingFormat,
)
from tactile_core.interfaces.recording_writer import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.quantities import Image, Reference
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import depend_on, report, report_errors
from tactile_core.testing.imports import find_leaks
from tactile_core.testing.registered import Part

_Named = tuple[Any, ...]  # The name of an entry, and what can be compared

_NAME = "0001"  # Of the reference

_SESSION = RecordedSession(
    profile="schema: 1\nname: small\nimage: {width_px: 8, height_px: 6, mm_per_px: 0.1}\n",
    sensor="small",
    channels=("red", "green", "blue"),
    serial="0001",
)


class RecordingFormatChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.recording_format.RecordingFormat`."""

    @check("recording_format")
    def test_copies(self, part: Part) -> None:
        """What is written is read: session, images, events and references, in their order."""
        why = "a converted recording gives other readings than the recording"
        do = "write and read each value exactly; tactile_core.recordings.session_files has the rest"
        with report_errors(part, "it does not write and read a recording", why=why, do=do):
            written, read = _copy(part, self.registered.class_of(part)())
        for (name, *one), other in zip_longest(written, read, fillvalue=("nothing",)):
            same = other == (name, *one)
            report(part, "" if same else f"{name} is written and {other[0]} read", why=why, do=do)

    @check("recording_format")
    def test_format_leaks(self, part: Part) -> None:
        """Closing a writer or a recording ends all its threads and closes all its files."""
        form = self.registered.class_of(part)()
        with depend_on("copies"):
            left = find_leaks(lambda: _copy(part, form))
        report(
            part,
            left and f"after close() there is still {left}",
            why="a program that runs for a long time runs out of resources",
            do="close the files and end the threads in close(), and wait for the threads",
        )


def _copy(part: Part, form: RecordingFormat) -> tuple[list[_Named], list[_Named]]:
    """Write a recording and return its content, and what is read of it, each with a name."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "one").with_suffix(f".{part.use.partition('.')[2]}")
        writer = form.write(path)
        writer.open(_SESSION)
        written = _write(writer)
        writer.close()
        with form.read(path) as file:
            return written, _read(file)


def _write(writer: RecordingWriter) -> list[_Named]:
    pixels = np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8)
    encoded = cv2.imencode(".jpg", pixels)[1].tobytes()
    decoded = decode_image(encoded, "the image")
    reference = Reference(np.full((6, 8, 3), 90.5, np.float32), _SESSION.channels)
    sent = (
        RecordedImage(Image(pixels, 1 / 3, 1.7e9, 0, exposure_time_s=0.01), 0, levels={"red": 0.5}),
        RecordedImage(Image(decoded, 0.5, 1.7e9 + 1 / 7, 2, encoded=encoded), 2),
    )
    content = [_named_session(_SESSION)]
    for one in sent:
        writer.write_image(one)
        content.append(_named_image(one.image, one.describe_image()))
    writer.write_reference(_NAME, reference)
    for name, values in ((REFERENCE, {"name": _NAME}), ("measured", {"number": 2})):
        writer.write_event(name, values)
        content.append((f"the event {name!r}", values))
    return [*content, ("the reference", reference.pixels.tolist())]


def _read(file: RecordingFile) -> list[_Named]:
    content = [_named_session(file.session)]
    for entry in file.entries:
        if isinstance(entry, EventEntry):
            content.append((f"the event {entry.name!r}", dict(entry.values)))
        else:
            content.append(_named_image(file.image(entry), dict(entry.described)))
    return [*content, ("the reference", file.reference(_NAME).pixels.tolist())]


def _named_session(session: RecordedSession) -> _Named:
    return "the session", session.profile, session.channels, session.serial


def _named_image(image: Any, described: dict[str, Any]) -> _Named:
    name = f"image {described['number']}"
    return name, described, image.encoded, image.pixels.tolist()
