"""The queue of unread images: what is kept, dropped, counted and refused."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.image_sources import numbered

from tactile_core.errors import CameraLost, CameraTimeout, DeviceError
from tactile_core.interfaces.streaming.image_queue import ImageQueue, QueueParameters
from tactile_core.quantities import Image


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def read_all(queue: ImageQueue) -> list[Image]:
    images = []
    while True:
        try:
            image = queue.next(0)
        except CameraTimeout:
            return images
        if image is None:
            return images
        images.append(image)


ARRIVALS = st.lists(st.sampled_from(["new", "again", "torn", "read"]), max_size=60)


@given(ARRIVALS, st.integers(1, 5))
def test_the_newest_unread_images_are_kept_and_all_others_counted(
    events: list[str], unread: int
) -> None:
    queue = ImageQueue("a camera", "oldest", QueueParameters(unread=unread))
    waiting: list[int] = []
    read: list[int] = []
    came = again = torn = 0
    for event in events:
        if event == "new":
            assert queue.put(numbered(came))
            waiting.append(came)
            came += 1
        elif event == "again" and came:
            assert queue.put(numbered(came - 1))
            again += 1
        elif event == "torn":
            queue.put_torn()
            torn += 1
        elif event == "read":
            waiting = waiting[-unread:]
            found = [int(image.timestamp_s) for image in read_all(queue)]
            assert found == waiting
            read += waiting
            waiting = []
    counts = queue.statistics
    assert (counts.received, counts.repeated, counts.torn) == (came, again, torn)
    assert counts.dropped == came - len(read) - len(waiting[-unread:])


@given(ARRIVALS)
def test_never_dropping_delivers_every_exposure_once_and_in_order(events: list[str]) -> None:
    queue = ImageQueue("a camera", "never")
    came = 0
    images: list[Image] = []
    for event in events:
        if event == "new":
            queue.put(numbered(came))
            came += 1
        elif event == "again" and came:
            queue.put(numbered(came - 1))
        elif event == "torn":
            queue.put_torn()
        elif event == "read":
            images += read_all(queue)
    images += read_all(queue)
    assert [image.timestamp_s for image in images] == list(range(came))
    assert queue.statistics.dropped == 0


@given(st.lists(st.booleans(), max_size=40))
def test_a_gap_in_the_sequence_numbers_is_a_torn_image(whole: list[bool]) -> None:
    queue = ImageQueue("a camera", "never")
    for number, is_whole in enumerate(whole):
        if is_whole:
            queue.put(numbered(number))
        else:
            queue.put_torn()
    assert [image.sequence for image in read_all(queue)] == [i for i, w in enumerate(whole) if w]


def test_without_room_never_dropping_ends_with_an_error_after_the_images_that_fitted() -> None:
    image = numbered(0)
    queue = ImageQueue("a camera", "never", QueueParameters(never_bytes=2 * image.pixels.nbytes))
    assert [queue.put(numbered(number)) for number in range(4)] == [True, True, False, False]
    assert [queue.next(0), queue.next(0)] != [None, None]
    with pytest.raises(DeviceError, match="a camera sends images faster than they are read: 2"):
        queue.next(0)
    assert queue.statistics.dropped == 1


def test_one_image_larger_than_the_memory_for_unread_images_still_passes() -> None:
    queue = ImageQueue("a camera", "never", QueueParameters(never_bytes=1))
    for number in range(3):
        assert queue.put(numbered(number))
        assert queue.next(0) is not None


def test_equal_bytes_with_a_new_timestamp_are_counted_and_delivered() -> None:
    dark = np.zeros((4, 4), np.uint8)
    queue = ImageQueue("a camera", "never")
    for time_s in (0.0, 1.0, 2.0):
        queue.put(Image(dark, timestamp_s=time_s))
    assert len(read_all(queue)) == 3
    assert queue.statistics.repeated == 2


def test_compressed_images_are_compared_as_the_camera_sent_them() -> None:
    queue = ImageQueue("a camera", "never")
    for time_s, sent in enumerate((b"one", b"one", b"two")):
        queue.put(replace(numbered(0, float(time_s)), encoded=sent))
    assert queue.statistics.repeated == 1


def test_timestamps_never_decrease() -> None:
    queue = ImageQueue("a camera", "never")
    for time_s in (3.0, 2.0, 4.0):
        queue.put(numbered(int(time_s)))
    assert [image.timestamp_s for image in read_all(queue)] == [3.0, 4.0]


@given(st.floats(1, 500), st.integers(2, 50))
def test_the_measured_rate_is_that_of_the_timestamps(rate_hz: float, count: int) -> None:
    clock = Clock()
    queue = ImageQueue("a camera", clock=clock)
    for number in range(count):
        clock.now_s = number / rate_hz
        queue.put(numbered(number, clock.now_s))
    assert queue.statistics.rate_hz == pytest.approx(rate_hz)
    clock.now_s += 2.5
    assert queue.statistics.rate_hz == 0


@given(st.floats(0, 10), st.floats(0.001, 10))
def test_latest_refuses_exactly_what_is_too_old(age_s: float, max_age_s: float) -> None:
    clock = Clock()
    queue = ImageQueue("a camera", clock=clock)
    queue.put(numbered(0, 0.0))
    clock.now_s = age_s
    queue.end(CameraLost("unplugged"))  # so that none is awaited
    if age_s <= max_age_s:
        assert queue.latest(max_age_s) is not None
    else:
        with pytest.raises(CameraLost):
            queue.latest(max_age_s)


def test_latest_leaves_an_image_unread_and_returns_it_again() -> None:
    queue = ImageQueue("a camera", clock=lambda: 1.0)
    for number in range(2):
        queue.put(numbered(number))
    assert queue.latest(0.5) is queue.latest(0.5)
    image = queue.next(0)
    assert image is not None
    assert image is queue.latest(0.5)
    with pytest.raises(CameraTimeout):
        queue.next(0)


def test_a_stale_image_is_refused_with_its_age_limit() -> None:
    queue = ImageQueue("a camera", clock=lambda: 100.0)
    queue.put(numbered(0))
    with pytest.raises(CameraTimeout, match=r"no image that is at most 0.01 s old"):
        queue.latest(0.01)


def test_a_timeout_names_the_camera_and_what_came_instead() -> None:
    queue = ImageQueue("the camera 0042")
    queue.put_torn()
    with pytest.raises(CameraTimeout, match=r"the camera 0042 sent no image within 0 s; 1 came"):
        queue.next(0)


def test_the_error_comes_after_the_unread_images_and_as_a_new_object_each_time() -> None:
    queue = ImageQueue("a camera", "never")
    queue.put(numbered(0))
    queue.end(CameraLost("unplugged"))
    queue.end(DeviceError("a later one is not the reason"))
    assert not queue.put(numbered(1))
    assert queue.next(0) is not None
    raised = []
    for _ in range(2):
        with pytest.raises(CameraLost, match="unplugged") as caught:
            queue.next(10)
        raised.append(caught.value)
    assert raised[0] is not raised[1]


def test_a_recording_ends_with_none() -> None:
    queue = ImageQueue("a recording")
    queue.end()
    assert queue.next(10) is None
    assert queue.latest(10) is None


@pytest.mark.parametrize("end", [True, False], ids=["end", "image"])
def test_a_waiting_reader_wakes_at_once(end: bool) -> None:
    queue = ImageQueue("a camera")
    results: list[Image | None] = []
    thread = threading.Thread(target=lambda: results.append(queue.next(60)))
    thread.start()
    if end:
        queue.end()
    else:
        queue.put(numbered(0))
    thread.join(10)
    assert not thread.is_alive()
    assert (results == [None]) is end
