"""Cameras with a reader thread: order, errors in bounded time, and nothing left behind."""

from __future__ import annotations

import gc
import threading
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.image_sources import TORN, Patient, Scripted, ScriptedCamera, numbered

from tactile_core.errors import CameraLost, CameraTimeout, DeviceError
from tactile_core.interfaces.streaming.image_queue import ImageQueue, QueueParameters
from tactile_core.interfaces.streaming.streaming_camera import ImageReader, ReaderParameters
from tactile_core.testing.imports import Footprint

PATIENCE_S = 10.0


@settings(max_examples=25)
@given(st.lists(st.sampled_from(["image", "torn"]), max_size=20))
def test_every_whole_image_arrives_and_then_the_reason_why_none_follows(script: list[str]) -> None:
    given_ = [TORN if one == "torn" else numbered(i) for i, one in enumerate(script)]
    before = Footprint.take_snapshot()
    camera = ScriptedCamera(*given_, CameraLost("the camera was unplugged"))
    camera.set_drop("never")
    with camera:
        for number, one in enumerate(script):
            if one == "image":
                image = camera.read(PATIENCE_S)
                assert image is not None
                assert image.sequence == image.timestamp_s == number
        with pytest.raises(CameraLost, match="unplugged"):
            camera.read(PATIENCE_S)
        with pytest.raises(CameraLost, match="unplugged"):
            camera.latest(PATIENCE_S)
    assert camera.statistics.torn == script.count("torn")
    assert camera.sources[0].closed == 1
    assert before.find_leaks() == ""


def test_a_stalled_camera_times_out_and_goes_on_afterwards() -> None:
    with ScriptedCamera(numbered(0)) as camera:
        assert camera.read(PATIENCE_S) is not None
        with pytest.raises(CameraTimeout, match=r"ScriptedCamera sent no image within 0.02 s"):
            camera.read(0.02)
        camera.sources[0].give(numbered(1))
        assert camera.read(PATIENCE_S) is not None


def test_a_recording_ends_with_none_and_a_reopened_one_starts_again() -> None:
    camera = ScriptedCamera(numbered(7), None)
    for _ in range(2):
        with camera:
            image = camera.read(PATIENCE_S)
            assert image is not None
            assert image.sequence == 0
            assert camera.read(PATIENCE_S) is None
    assert [source.closed for source in camera.sources] == [1, 1]


def test_an_error_of_the_drivers_code_reaches_the_caller() -> None:
    with ScriptedCamera(ZeroDivisionError("a bug")) as camera:
        for _ in range(2):
            with pytest.raises(ZeroDivisionError, match="a bug"):
                camera.read(PATIENCE_S)


def test_a_source_that_does_not_close_is_reported_once_the_thread_has_ended() -> None:
    before = Footprint.take_snapshot()
    camera = ScriptedCamera().open()
    camera.sources[0].closing_error = OSError("the bus is stuck")
    with pytest.raises(DeviceError, match="does not close: OSError: the bus is stuck"):
        camera.close()
    assert not camera.is_open
    camera.close()
    assert before.find_leaks() == ""


def test_a_driver_that_never_returns_does_not_hold_up_close() -> None:
    released = threading.Event()

    class Stuck(Scripted):
        def grab(self) -> None:
            released.wait(PATIENCE_S)

    source = Stuck()
    reader = ImageReader(source, ImageQueue("x"), "the camera x", ReaderParameters(join_s=0.02))
    with pytest.raises(DeviceError, match=r"reader of the camera x has not returned for 0.02 s"):
        reader.close()
    assert source.closed == 0, "a driver is never closed while it is in use"
    released.set()
    reader.close()
    assert source.closed == 1


def test_a_camera_that_is_forgotten_ends_its_thread() -> None:
    before = Footprint.take_snapshot()
    camera = ScriptedCamera().open()
    source = camera.sources[0]
    del camera
    gc.collect()
    assert before.find_leaks() == ""
    assert source.closed == 1


def test_images_that_can_wait_are_not_grabbed_before_there_is_room() -> None:
    count = 20
    source = Patient([*map(numbered, range(count)), None])
    queue = ImageQueue("a folder", "never", QueueParameters(never_bytes=1))
    reader = ImageReader(source, queue, "a folder")
    images = [queue.next(PATIENCE_S) for _ in range(count)]
    assert [image.sequence for image in images if image] == list(range(count))
    assert queue.next(PATIENCE_S) is None
    reader.close()


def test_a_triggered_read_returns_no_image_of_an_earlier_trigger() -> None:
    with ScriptedCamera(numbered(0, time.monotonic() - 1)) as camera:
        source = camera.sources[0]
        fresh = numbered(1, time.monotonic() + 100)
        image = camera._read_triggered(lambda: source.give(fresh), PATIENCE_S)
        assert image is not None
        assert image.timestamp_s == fresh.timestamp_s
        with pytest.raises(CameraTimeout):
            camera._read_triggered(lambda: None, 0.01)


def test_a_closed_camera_has_no_latest_image() -> None:
    with pytest.raises(DeviceError, match="closed"):
        ScriptedCamera().latest(1.0)


def test_the_statistics_describe_the_current_opening() -> None:
    camera = ScriptedCamera(numbered(0), TORN, CameraLost("gone"))
    for _ in range(2):
        with camera:
            assert camera.read(PATIENCE_S) is not None
            with pytest.raises(CameraLost):
                camera.read(PATIENCE_S)
            assert (camera.statistics.received, camera.statistics.torn) == (1, 1)
