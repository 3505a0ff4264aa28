"""Readings for rerun, read back with rerun's own reader."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.readings import SHAPE, contact, height, markers, reading, slopes

from tactile_core.errors import InputError
from tactile_core.interfaces.sink import Reading, Session
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Gradients, HeightMap, Image, MarkerField, SlipState
from tactile_core.recordings.output_folder import OutputFolder
from tactile_rerun.rerun_log import RerunLog, RerunOptions


def logged(folder: Path, *readings: Reading) -> Path:
    sink = RerunLog(RerunOptions())
    build = load_profile("hex_fingertip")
    sink.open(Session(build, "0007", ("r", "g", "b"), (), OutputFolder(folder)))
    for one in readings:
        sink.write(one)
    sink.close()
    return folder / "hex_fingertip-0007.rrd"


def columns(path: Path) -> dict[str, list[Any]]:
    """Return ``entity component`` with its rows, as rerun reads them."""
    import pyarrow as pa
    from rerun.chunk import RrdReader

    found: dict[str, list[Any]] = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            column = batch[name]
            if pa.types.is_timestamp(column.type):  # datetime has no nanoseconds
                column = column.cast(pa.timestamp("us", column.type.tz), safe=False)
            found.setdefault(f"{chunk.entity_path} {name}", []).extend(column.to_pylist())
    return found


def test_numbers_units_and_times_are_those_of_the_readings(tmp_path: Path) -> None:
    taken = [
        reading(height(n / 8), slopes(), contact(), markers(), SlipState("stick", 0.5))
        for n in range(3)
    ]
    found = columns(logged(tmp_path, *taken))
    for number, one in enumerate(taken):
        buffer = np.array(found["/height DepthImage:buffer"][number][0], np.uint8)
        tall = buffer.view(np.float32).reshape(SHAPE)
        np.testing.assert_array_equal(tall, one[HeightMap].mm)
        slope = found["/Gradients/x Tensor:data"][number][0]
        np.testing.assert_array_equal(slope["buffer"], one[Gradients].x.ravel())
        assert (slope["shape"], slope["names"]) == ([*SHAPE], ["y", "x"])
        px = found["/MarkerField/px Tensor:data"][number][0]
        np.testing.assert_array_equal(px["buffer"], one[MarkerField].px.ravel())
    assert found["/height DepthImage:meter"][0] == [1000.0]
    assert found["/height unit"][0] == ["mm"]
    assert found["/height axes"][0] == ["y x"]
    assert found["/SlipState/degree Scalars:scalars"] == [[0.5]] * 3
    assert found["/SlipState/state TextLog:text"] == [["stick"]] * 3


def test_a_jpeg_stays_the_camera_s_own_bytes(tmp_path: Path) -> None:
    pixels = np.full((16, 16, 3), 90, np.uint8)
    jpeg = cv2.imencode(".jpg", pixels)[1].tobytes()
    frame = Frame(
        np.zeros((*SHAPE, 3), np.uint8),
        ("r", "g", "b"),
        0.1,
        timestamp_s=2.5,
        wall_time_s=1.7e9,
        raw=(Image(pixels, encoded=jpeg),),
    )
    found = columns(logged(tmp_path, Reading(frame, {}, {})))
    assert bytes(found["/camera EncodedImage:blob"][0][0]) == jpeg
    assert found["/camera time"][0].total_seconds() == 2.5
    assert found["/camera wall_time"][0].timestamp() == 1.7e9


_LOGGING = """
import sys
from pathlib import Path
sys.path[:0] = sys.argv[2:]
from test_rerun_log import *
logged(Path(sys.argv[1]), reading(height()))
"""


def test_nothing_is_sent_anywhere(tmp_path: Path) -> None:
    strace = shutil.which("strace")
    if strace is None:
        pytest.skip("strace is not installed, which lists the connections of a program")
    calls, here = tmp_path / "calls", Path(__file__).parent
    command = [strace, "-f", "-e", "trace=connect,sendto,sendmsg", "-o", calls]
    command += [sys.executable, "-c", _LOGGING, tmp_path / "out", here, here.parents[2] / "tests"]
    subprocess.run(command, check=True)
    assert (tmp_path / "out").is_dir()
    assert "exited with 0" in calls.read_text()
    assert "AF_INET" not in calls.read_text()


def test_a_port_without_a_viewer_is_one_sentence() -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
    sink = RerunLog(RerunOptions(port=port))
    with pytest.raises(InputError, match=f"start one with: rerun --port {port}"):
        sink.open(Session(load_profile("hex_fingertip"), None, (), ()))
