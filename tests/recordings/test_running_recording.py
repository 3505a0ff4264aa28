"""A recording survives what can happen to its program and its disk, and never disturbs a sensor."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.recordings import SESSION, image
from support.soak import share_of
from support.virtual_lab import VirtualLab
from support.watching import until

from tactile_core import open_sensor
from tactile_core.interfaces.recording_format import EventEntry, ImageEntry
from tactile_core.interfaces.recording_writer import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Image, Reference
from tactile_core.recordings.appended_file import AppendedFile
from tactile_core.recordings.recovery import recover
from tactile_core.recordings.running_recording import RecordingParameters, RunningRecording
from tactile_core.recordings.source import recording_file, recording_writer

TESTS = Path(__file__).resolve().parents[1]
RECORDS = """\
import sys, time
from pathlib import Path
import numpy as np
from support.recordings import SESSION, image
from tactile_core.quantities import Image
from tactile_core.recordings.appended_file import AppendedFile
from tactile_core.recordings.source import recording_writer
from tactile_core.recordings.running_recording import RunningRecording
recording = RunningRecording(recording_writer(Path(sys.argv[1])), SESSION)
number = 0
while True:
    pixels = np.full((240, 320, 3), number % 256, np.uint8)
    recording.add_image(Image(pixels, timestamp_s=number / 60, sequence=number), {})
    print(number, time.monotonic(), flush=True)
    number += 1
    time.sleep(1 / 60)
"""
FILLS = """\
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
""" + RECORDS.replace(
    "    number += 1\n",
    "    number += 1\n    if recording.failure: print(recording.failure); sys.exit(7)\n",
)


def recorder(program: str, path: Path) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path])}
    return subprocess.Popen(
        [sys.executable, "-c", program, path], stdout=subprocess.PIPE, text=True, env=environment
    )


def recorded(path: Path) -> list[Image]:
    with recording_file(path) as file:
        return [file.image(entry) for entry in file.entries if isinstance(entry, ImageEntry)]


def assert_kept(path: Path, after_s: float) -> None:
    """Kill a recording, and check that each image of half a second earlier is there and whole."""
    with recorder(RECORDS, path) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        time.sleep(after_s)
        killed_s = time.monotonic()
        process.send_signal(signal.SIGKILL)
        lines = [first, *process.stdout]
    arrived = [(int(n), float(s)) for n, s in (line.split() for line in lines if line[-1] == "\n")]
    safe = [number for number, at_s in arrived if at_s < killed_s - 0.5]
    found = recorded(path)
    assert [one.sequence for one in found[: len(safe)]] == safe
    assert all((one.pixels == one.sequence % 256).all() for one in found)
    if not found:  # killed before the first image was written
        return
    again = recorded(recover(path).path)
    assert [one.sequence for one in again] == [one.sequence for one in found]


@pytest.mark.parametrize("after_s", [1.1, 1.7])
def test_a_killed_program_loses_less_than_half_a_second(tmp_path: Path, after_s: float) -> None:
    assert_kept(tmp_path / "killed.mcap", after_s)


@pytest.mark.soak
@pytest.mark.timeout(1200)
def test_programs_that_are_killed_at_any_moment_lose_less_than_half_a_second(
    tmp_path: Path,
) -> None:
    for number, after_s in enumerate(np.random.default_rng(0).uniform(0, 4, share_of(50))):
        assert_kept(tmp_path / f"{number}.mcap", float(after_s))


def test_a_file_that_may_not_grow_ends_the_recording_and_opens(tmp_path: Path) -> None:
    with recorder(FILLS, tmp_path / "full.mcap") as process:
        assert process.stdout is not None
        *_, message = process.stdout
    assert process.returncode == 7
    assert "ended after 4 images (File too large); free the disk" in message
    found = recorded(tmp_path / "full.mcap")
    assert [one.sequence for one in found] == [0, 1, 2, 3]


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 2 MB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(place)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting a small disk is not permitted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def measured(lab: VirtualLab, path: Path, harm: Any) -> tuple[RunningRecording, list[Reading]]:
    """Record the lab's presses three times, while something happens to the disk."""
    readings: list[Reading] = []
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor:
        with sensor.record(path) as recording:
            readings.append(sensor.read())
            time.sleep(0.4)  # longer than until the next flush
            harm()
            for reading in sensor.stream():
                readings.append(reading)
                time.sleep(0.05)
        time.sleep(0)
    return recording, readings


def warned(readings: list[Reading]) -> list[str]:
    return [w for one in readings for w in one.warnings if w.startswith("the recording")]


def test_a_full_disk_is_one_warning_and_the_sensor_goes_on(
    lab: VirtualLab, small_disk: Path
) -> None:
    def fill() -> None:
        room = os.statvfs(small_disk)
        (small_disk / "other").write_bytes(bytes(room.f_bavail * room.f_bsize - 8192))

    path = small_disk / "one.mcap"
    recording, readings = measured(lab, path, fill)
    assert len(readings) == 10
    assert recording.failure is not None
    assert "No space left on device" in recording.failure
    assert warned(readings) == [recording.failure]
    assert len(recorded(path)) >= 1


def test_a_deleted_folder_is_one_warning_and_the_sensor_goes_on(
    lab: VirtualLab, tmp_path: Path
) -> None:
    folder = tmp_path / "gone"
    folder.mkdir()
    recording, readings = measured(lab, folder / "one.mcap", lambda: shutil.rmtree(folder))
    assert len(readings) == 10
    assert recording.failure is not None
    assert "it was deleted" in recording.failure
    assert warned(readings) == [recording.failure]


@pytest.mark.parametrize("name", ["one.mcap", "one"])
def test_a_recording_that_was_deleted_at_the_very_end_is_noticed(tmp_path: Path, name: str) -> None:
    recording = RunningRecording(recording_writer(tmp_path / name), SESSION)
    recording.add_image(image(0), {})
    until(lambda: recording.images == 1)
    shutil.rmtree(tmp_path / name) if name == "one" else (tmp_path / name).unlink()
    recording.close()
    assert recording.failure is not None
    assert "it was deleted" in recording.failure
    assert not (tmp_path / name).exists()


def test_a_recording_that_nobody_adds_to_notices_that_it_was_deleted(tmp_path: Path) -> None:
    limits = RecordingParameters(check_s=0.01)
    with RunningRecording(recording_writer(tmp_path / "a.mcap"), SESSION, parameters=limits) as one:
        (tmp_path / "a.mcap").unlink()
        until(lambda: one.failure is not None)


def test_what_was_written_is_in_the_file_before_anything_else_happens(tmp_path: Path) -> None:
    writer = recording_writer(tmp_path / "one.mcap")
    writer.open(SESSION)
    for number in range(3):
        writer.write_image(RecordedImage(image(number), number))
        assert len(recorded(tmp_path / "one.mcap")) == number + 1
        writer.write_event("measured", {"number": number})
        with recording_file(tmp_path / "one.mcap") as file:
            assert file.entries[-1] == EventEntry("measured", {"number": number})
    writer.close()


LOADS = """\
import sys
from pathlib import Path
from support.recordings import SESSION, image
from tactile_core.recordings.source import recording_writer
from tactile_core.interfaces.recording_writer import RecordedImage
writer = recording_writer(Path(sys.argv[1]))
one = image(0)
writer.open(SESSION)
before = set(sys.modules)
writer.write_image(RecordedImage(one, 0))
print(sorted(set(sys.modules) - before))
"""


def test_the_first_image_waits_for_no_library(tmp_path: Path) -> None:
    with recorder(LOADS, tmp_path / "one.mcap") as process:
        assert process.stdout is not None
        assert process.stdout.read() == "[]\n"


def test_what_does_not_fit_leaves_nothing_behind(tmp_path: Path) -> None:
    file = AppendedFile(tmp_path / "a")
    file.write(b"whole")
    was = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8, was[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            file.write(b"too long")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, was)
    file.close()
    assert (tmp_path / "a").read_bytes() == b"whole"


def test_a_recording_that_cannot_begin_leaves_no_file(tmp_path: Path) -> None:
    was = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, was[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            RunningRecording(recording_writer(tmp_path / "a.mcap"), SESSION)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, was)
    assert list(tmp_path.iterdir()) == []


def test_a_copy_waits_for_its_disk_and_leaves_nothing_out(tmp_path: Path) -> None:
    writer = StuckWriter(tmp_path / "stuck.mcap")
    limits = RecordingParameters(queue_bytes=3 * image(0).pixels.nbytes)
    recording = RunningRecording(writer, SESSION, waits=True, parameters=limits)
    threading.Timer(0.2, writer.answers.set).start()
    for number in range(20):
        recording.add_image(image(number), {})
    recording.close()
    assert (recording.images, recording.dropped, recording.left_out()) == (20, 0, "")


def test_an_image_larger_than_the_queue_is_recorded(tmp_path: Path) -> None:
    limits = RecordingParameters(queue_bytes=10)
    writer = recording_writer(tmp_path / "a.mcap")
    with RunningRecording(writer, SESSION, parameters=limits) as recording:
        recording.add_image(image(0), {})
        until(lambda: recording.images == 1)
    assert recording.dropped == 0


def test_an_image_that_is_left_out_keeps_its_number(tmp_path: Path) -> None:
    writer = StuckWriter(tmp_path / "stuck.mcap")
    limits = RecordingParameters(queue_bytes=1)
    recording = RunningRecording(writer, SESSION, parameters=limits)
    for number in range(4):
        recording.add_image(image(number), {})
    writer.answers.set()
    until(lambda: writer.written == recording.images == 4 - recording.dropped)
    recording.add_image(image(4), {})
    recording.close()
    assert writer.numbers[-1] == 4
    assert f"{recording.dropped} images were left out of" in recording.left_out()


def test_a_deleted_folder_of_images_is_one_warning(lab: VirtualLab, tmp_path: Path) -> None:
    folder = tmp_path / "images"
    recording, readings = measured(lab, folder, lambda: shutil.rmtree(folder))
    assert len(readings) == 10
    assert recording.failure is not None
    assert warned(readings) == [recording.failure]


def test_a_withdrawn_permission_does_not_end_a_file_that_is_open(
    lab: VirtualLab, tmp_path: Path
) -> None:
    folder = tmp_path / "closed"
    folder.mkdir()
    path = folder / "one.mcap"

    def withdraw() -> None:
        path.chmod(0o400)
        folder.chmod(0o500)

    recording, readings = measured(lab, path, withdraw)
    assert (recording.failure, recording.images) == (None, len(readings))
    assert len(recorded(path)) == len(readings)


@pytest.mark.skipif(getattr(os, "geteuid", lambda: 0)() == 0, reason="root needs no permission")
def test_a_withdrawn_permission_for_a_folder_of_images_is_one_warning(
    lab: VirtualLab, tmp_path: Path
) -> None:
    folder = tmp_path / "images"
    recording, readings = measured(lab, folder, lambda: folder.chmod(0o500))
    assert len(readings) == 10
    assert recording.failure is not None
    assert warned(readings) == [recording.failure]
    assert len(recorded(folder)) >= 1


class StuckWriter(RecordingWriter):
    """A disk that does not answer."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.answers = threading.Event()
        self.written = 0
        self.numbers: list[int] = []

    def open(self, session: RecordedSession) -> None:
        pass

    def write_image(self, recorded: RecordedImage) -> None:
        self.answers.wait()
        self.numbers.append(recorded.number)
        self.written += 1

    def write_event(self, name: str, values: Mapping[str, Any]) -> None:
        pass

    def write_reference(self, name: str, reference: Reference) -> None:
        pass

    def write_reading(self, reading: Reading) -> None:
        pass

    def check(self) -> None:
        pass

    def close(self) -> None:
        pass


def test_a_disk_that_does_not_answer_costs_images_and_no_more_memory(tmp_path: Path) -> None:
    writer = StuckWriter(tmp_path / "stuck.mcap")
    size = image(0).pixels.nbytes
    limits = RecordingParameters(queue_bytes=10 * size)
    recording = RunningRecording(writer, SESSION, parameters=limits)
    for number in range(100):
        recording.add_image(image(number), {})
    assert recording.dropped >= 89
    writer.answers.set()
    recording.close()
    assert recording.images == writer.written == 100 - recording.dropped


def test_a_disk_that_never_answers_lets_the_program_end(tmp_path: Path) -> None:
    writer = StuckWriter(tmp_path / "stuck.mcap")
    recording = RunningRecording(writer, SESSION, parameters=RecordingParameters(close_s=0.05))
    recording.add_image(image(0), {})
    recording.close()
    assert recording.failure is not None
    assert "the disk does not answer" in recording.failure
    writer.answers.set()


def test_an_error_of_a_writer_ends_the_recording_in_a_sentence(tmp_path: Path) -> None:
    writer = recording_writer(tmp_path / "one.mcap")
    recording = RunningRecording(writer, SESSION)
    recording.add_image(image(0), {})
    recording.add_event("bad", {"value": object()})
    recording.add_image(image(1), {})
    recording.close()
    recording.close()
    assert recording.failure is not None
    assert "TypeError" in recording.failure
    assert len(recorded(tmp_path / "one.mcap")) == 1
