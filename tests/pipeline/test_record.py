"""A sensor records while it measures, and a replay measures the same, bit for bit."""

from __future__ import annotations

import json
import resource
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.command_line import refused, tactile
from support.light_box import light_box
from support.live_sensor import box as serial_box
from support.live_sensor import profile as live_profile
from support.live_sensor import send, stream
from support.mjpeg_server import Exchange, MjpegServer
from support.recordings import Arrays, arrays_of, assert_equal
from support.virtual_lab import BALL_MM, VirtualLab
from support.watching import until

from tactile_core import open_sensor
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import InputError
from tactile_core.interfaces.recording_format import EventEntry, ImageEntry
from tactile_core.pipeline.playback import read_frames
from tactile_core.pipeline.sensor import Sensor
from tactile_core.recordings.recording import open_recording
from tactile_core.recordings.running_recording import RunningRecording
from tactile_core.recordings.source import recording_file

FRAMES = 6


class Presses:
    """A camera on the network that shows presses one after another, and what it has sent."""

    def __init__(self, lab: VirtualLab) -> None:
        presses = [None] * 3 + [BallPress((40.0 + 5 * n, 60.0), BALL_MM, 0.5) for n in range(16)]
        self.jpegs = [
            bytes(cv2.imencode(".jpg", lab.image(press, seed=n)[..., ::-1])[1])
            for n, press in enumerate(presses)
        ]
        self.sent: list[bytes] = []

    def __call__(self, exchange: Exchange) -> None:
        exchange.begin()
        while not exchange.stopped.wait(0.01):
            jpeg = self.jpegs[len(self.sent) % len(self.jpegs)]
            self.sent.append(jpeg)
            exchange.send_image(jpeg)


@pytest.fixture
def camera(lab: VirtualLab) -> Presses:
    return Presses(lab)


@pytest.fixture
def live(lab: VirtualLab, camera: Presses, tmp_path: Path) -> Iterator[Path]:
    """The profile of the lab with a camera on the network."""
    path = tmp_path / "live.yaml"
    with MjpegServer(camera) as server:
        path.write_text(f"extends: {lab.profile_path}\ncamera: {stream(server.url)}\n")
        yield path


def replayed(profile: str | Path, path: Path, **options: object) -> list[Arrays]:
    with open_sensor(profile, input=path, **options) as sensor:  # type: ignore[arg-type]
        return [arrays_of(reading) for reading in sensor.stream()]


def read(sensor: Sensor, count: int) -> list[Arrays]:
    return [arrays_of(sensor.read()) for _ in range(count)]


@pytest.mark.parametrize("name", ["hex_fingertip", "desktop_six_led", "baxter_fingertip"])
def test_every_rig_measures_the_same_again(name: str, tmp_path: Path) -> None:
    with open_sensor(name, sim=True, reference="first") as sensor:
        read(sensor, 2)  # what was tracked before the recording is no part of it
        with sensor.record(tmp_path / "one.mcap") as recording:
            measured = read(sensor, 2)
            sensor.tare()
            measured += read(sensor, FRAMES - 2)
    exposures = 6 if name == "desktop_six_led" else 1
    assert (recording.images, recording.dropped, recording.failure) == (FRAMES * exposures, 0, None)
    assert_equal(measured, replayed(name, tmp_path / "one.mcap"))


def test_a_streaming_camera_is_recorded_whole_and_replayed_as_it_was_measured(
    live: Path, lab: VirtualLab, camera: Presses, tmp_path: Path
) -> None:
    with open_sensor(live, bundle=lab.bundle, serial="0007") as sensor:
        assert sensor.records_all
        with sensor.record(tmp_path / "one.mcap") as recording:
            measured = read(sensor, 2)
            sensor.capture_reference(2)
            sensor.tare()
            for _ in range(4):
                time.sleep(0.05)  # images arrive that nobody reads
                measured += read(sensor, 1)
    path = tmp_path / "one.mcap"
    assert_equal(measured, replayed(live, path))
    every = open_recording(path, every=True)
    encoded = [one.images[0].encoded for one in every]
    assert len(encoded) == recording.images > 2 * len(measured)
    begin = camera.sent.index(encoded[0] or b"")
    assert encoded == camera.sent[begin : begin + len(encoded)]
    assert recording.bytes == sum(len(one or b"") for one in encoded)


def test_sequential_lights_are_recorded_by_exposure_with_their_levels(tmp_path: Path) -> None:
    with MjpegServer(send) as server, light_box(lights=3) as box:
        path = live_profile(tmp_path, stream(server.url), serial_box(box.port))
        path.write_text(path.read_text().replace("core.constant", "core.sequential"))
        path.write_text(path.read_text().replace("mm_per_px: 0.1", "mm_per_px: 0.1, color: luma"))
        with open_sensor(path, timeout_s=5) as sensor, sensor.record(tmp_path / "one.mcap"):
            assert not sensor.records_all
            frames = [sensor.acquire() for _ in range(2)]
    with recording_file(tmp_path / "one.mcap") as file:
        entries = [e.described for e in file.entries if isinstance(e, ImageEntry)]
    assert [one["exposure_index"] for one in entries] == [0, 1, 2] * 2
    assert [one["levels"] for one in entries[:3]] == [{"red": 1}, {"green": 1}, {"blue": 1}]
    again = open_recording(tmp_path / "one.mcap", images_per_observation=3)
    for frame, observation in zip(frames, again, strict=True):
        assert frame is not None
        times = tuple(image.timestamp_s for image in observation.images)
        assert times == frame.exposure_times_s


def test_the_command_measures_a_recording_like_the_sensor(lab: VirtualLab, tmp_path: Path) -> None:
    common = ("run", lab.profile_path, "--reference", lab.reference, "--save", "npz,record")
    done = tactile(
        *(*common, "--input", lab.presses, "--bundle", lab.bundle, "--frames", 4),
        *("--out", tmp_path / "live"),
    )
    assert done.returncode == 0, done.stderr
    recorded = tmp_path / "live" / "recording.mcap"
    done = tactile("run", lab.profile_path, "--input", recorded, "--out", tmp_path / "again")
    assert done.returncode == 0, done.stderr
    ours, theirs = (sorted((tmp_path / n).glob("*.npz")) for n in ("live", "again"))
    assert len(ours) == len(theirs) == 4
    for one, other in zip(ours, theirs, strict=True):
        with np.load(one) as live, np.load(other) as again:
            assert set(live) == set(again)
            for name in live:
                np.testing.assert_array_equal(live[name], again[name], err_msg=name)


def test_an_option_precedes_what_a_recording_holds(lab: VirtualLab, tmp_path: Path) -> None:
    path = tmp_path / "one.mcap"
    with (
        open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor,
        sensor.record(path),
    ):
        sensor.read()
        sensor.read()
    with open_sensor(lab.profile_path, input=path) as sensor:
        own = sensor.pipeline
        assert own.bundle is not None
        assert own.serial is None
        assert own.given_reference is None  # that of the bundle
    with open_sensor(lab.profile_path, input=path, reference="first") as sensor:
        assert sensor.pipeline.reference is not None
        assert sensor.pipeline.reference.relative
    other = Bundle.load(lab.bundle)
    with open_sensor(lab.profile_path, input=path, bundle=other) as sensor:
        assert sensor.pipeline.bundle is other


def test_a_recording_is_an_input_for_presses_and_reference(lab: VirtualLab, tmp_path: Path) -> None:
    for name, shown in (("presses.mcap", lab.presses), ("reference.mcap", lab.reference)):
        done = tactile("record", lab.profile_path, "--input", shown, "--out", tmp_path / name)
        assert done.returncode == 0, done.stderr
        ours, theirs = (read_frames(lab.profile, path) for path in (shown, tmp_path / name))
        for one, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(one.pixels, other.pixels)


def test_presses_are_fitted_with_the_reference_in_their_recording(
    lab: VirtualLab, tmp_path: Path
) -> None:
    path = tmp_path / "presses"
    done = tactile(
        *("record", lab.profile_path, "--input", lab.presses),
        *("--reference", lab.reference, "--out", path),
    )
    assert done.returncode == 0, done.stderr
    fitted = [
        calibrate(
            lab.profile,
            presses,
            reference,
            ball_diameter_mm=BALL_MM,
            model="core.polynomial",
            scored=False,
        )
        for presses, reference in ((lab.presses, lab.reference), (path, None))
    ]
    one, other = (found.bundle.reference.pixels for found in fitted)
    np.testing.assert_array_equal(one, other)


def test_a_recording_of_another_sensor_or_unit_is_refused(lab: VirtualLab, tmp_path: Path) -> None:
    path = tmp_path / "one.mcap"
    with (
        open_sensor(lab.profile_path, bundle=lab.bundle, serial="0007", input=lab.presses) as one,
        one.record(path),
    ):
        one.read()
    assert "recorded with the profile virtual_lab" in refused(
        "run", "hex_fingertip", "--input", path
    )
    assert "recorded with virtual_lab 0007, whose observations have 1 exposure" in refused(
        "run", "desktop_six_led", "--input", path
    )
    assert "recorded with the unit 0007, not 0008" in refused(
        "run", lab.profile_path, "--input", path, "--serial", "0008"
    )


def test_readings_and_health_are_recorded_in_foxgloves_schemas(
    lab: VirtualLab, tmp_path: Path
) -> None:
    from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
    from mcap.reader import make_reader

    path = tmp_path / "one.mcap"
    with (
        open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor,
        sensor.record(path, readings=True),
    ):
        reading = sensor.read()
    height = reading["height"].mm  # type: ignore[attr-defined]
    with path.open("rb") as file:
        found = {
            channel.topic.removeprefix("/tactile/virtual_lab/"): (schema, message.data)
            for schema, channel, message in make_reader(file).iter_messages()
        }
    shown = RawImage.FromString(found["quantities/height_mm"][1])
    assert shown.encoding == "32FC1"
    assert shown.data == height.astype("<f4").tobytes()
    assert json.loads(found["summary"][1]) == reading.summary()
    assert json.loads(found["events/health"][1])["verdict"] in ("ok", "warning", "unknown")


def test_passwords_in_addresses_are_not_recorded(tmp_path: Path, lab: VirtualLab) -> None:
    path = tmp_path / "own.yaml"
    path.write_text(
        f"extends: {lab.profile_path}\n"
        "illumination: {driver: {use: core.serial_leds, lights: [red], port: 'tcp://me:secr@et@h?token=secret'}}\n"
    )
    with (
        open_sensor(path, input=lab.presses) as sensor,
        sensor.record(tmp_path / "one.mcap"),
    ):
        sensor.acquire()
    data = (tmp_path / "one.mcap").read_bytes()
    assert b"tcp://h" in data
    assert b"secr" not in data
    assert b"et@" not in data


def test_two_recordings_at_once_are_both_complete(live: Path, tmp_path: Path) -> None:
    with open_sensor(live, reference="first") as sensor, sensor.record(tmp_path / "long.mcap"):
        measured = read(sensor, 2)
        with sensor.record(tmp_path / "short.mcap"):
            both = read(sensor, 2)
        measured += both + read(sensor, 1)
    assert_equal(both, replayed(live, tmp_path / "short.mcap"))
    assert_equal(measured, replayed(live, tmp_path / "long.mcap"))


def test_closing_the_sensor_completes_its_recordings(lab: VirtualLab, tmp_path: Path) -> None:
    with open_sensor(lab.profile_path, input=lab.presses) as sensor:
        sensor.record(tmp_path / "one.mcap")
        sensor.read()
    with recording_file(tmp_path / "one.mcap") as file:
        assert file.finished
        assert next(e.name for e in file.entries if isinstance(e, EventEntry)) == "measured"


def test_hdf5_is_written_afterwards(lab: VirtualLab, tmp_path: Path) -> None:
    given = (lab.profile_path, "--input", lab.presses)
    assert "'tactile convert'" in refused("record", *given, "--out", tmp_path / "a.h5")
    saved = ("--reference", lab.reference, "--out", tmp_path / "out", "--save", "hdf5")
    assert "'tactile convert'" in refused("run", *given, *saved)
    assert list(tmp_path.iterdir()) == []


def test_a_run_whose_recording_ends_early_fails_in_a_sentence(
    lab: VirtualLab, tmp_path: Path
) -> None:
    was = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, was[1]))
    try:
        done = tactile(
            *("run", lab.profile_path, "--input", lab.presses, "--reference", lab.reference),
            *("--out", tmp_path / "out", "--save", "record"),
        )
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, was)
    assert done.returncode == 1
    (sentence,) = (line for line in done.stderr.splitlines() if not line.startswith("note"))
    assert "recording.mcap" in sentence
    assert "File too large" in sentence


def test_a_sink_that_records_needs_a_sensor(lab: VirtualLab) -> None:
    from tactile_core.pipeline.pipeline import Pipeline
    from tactile_core.pipeline.sinks import Sinks

    with pytest.raises(InputError, match="needs a sensor"):
        Sinks(lab.profile, ["record"]).open(Pipeline(lab.profile))


def images_in(path: Path) -> int:
    with suppress(InputError, FileNotFoundError), recording_file(path) as file:
        return sum(isinstance(entry, ImageEntry) for entry in file.entries)
    return 0  # it has no beginning yet


def test_ctrl_c_ends_a_recording_properly(live: Path, tmp_path: Path) -> None:
    path = tmp_path / "one.mcap"

    def interrupt_once_images_are_there() -> None:
        until(lambda: images_in(path) > 10)
        signal.raise_signal(signal.SIGINT)

    interrupting = threading.Thread(target=interrupt_once_images_are_there)
    interrupting.start()
    done = tactile("record", live, "--out", path, "--json")
    interrupting.join()
    assert done.returncode == 0, done.stderr
    with recording_file(path) as file:
        assert file.finished
        assert len(file.entries) == json.loads(done.stdout)["images"] > 10


def test_ctrl_c_before_the_first_image_says_that_nothing_was_recorded(
    live: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> Iterator[float]:
        signal.raise_signal(signal.SIGINT)
        yield 0.0

    monkeypatch.setattr("tactile_core.pipeline.conversion.keep_recording", interrupted)
    monkeypatch.setattr(RunningRecording, "add_image", lambda *_, **__: None)
    message = refused("record", live, "--out", tmp_path / "one.mcap")
    assert "ended before the first image" in message


def test_frames_ends_a_recording_of_a_stream_exactly(live: Path, tmp_path: Path) -> None:
    done = tactile("record", live, "--out", tmp_path / "one.mcap", "--frames", 25, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["images"] == 25


def test_a_recording_of_a_virtual_sensor_is_measured_without_a_simulator(
    lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "recording"
    with (
        open_sensor(lab.profile_path, bundle=lab.bundle, reference="first", sim=True) as sensor,
        sensor.record(path),
    ):
        for _ in range(2):
            sensor.read()
    absent = {"camera": {"use": "elsewhere.virtual"}}
    monkeypatch.setattr("tactile_core.profiles.loader._VIRTUAL", absent)
    with open_sensor(lab.profile_path, input=path, reference="first") as sensor:
        assert len(list(sensor.stream())) == 2
