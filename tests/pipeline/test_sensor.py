"""Opening, reading and closing of sensors and recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core import HeightMap, open_sensor
from tactile_core.acquisition import devices
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.builtin.sequential import ReplayCamera
from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.manifest import Starting
from tactile_core.bundles.places import default_place
from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import CalibrationError, CameraLost, DeviceError, InputError
from tactile_core.formats.images import write_png
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.pipeline.playback import played_back
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile


def test_a_recording_streams_one_reading_per_image(lab: VirtualLab) -> None:
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor:
        names = [reading.source for reading in sensor.stream()]
    assert names == [f"press_{i}" for i in range(10)]


def test_reading_past_the_end_raises_camera_lost(lab: VirtualLab) -> None:
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.reference) as sensor:
        sensor.read()
        with pytest.raises(CameraLost, match="end"):
            sensor.read()


def test_with_the_first_frame_as_reference_readings_are_relative(lab: VirtualLab) -> None:
    with open_sensor(
        lab.profile_path, bundle=lab.bundle, input=lab.presses, reference="first"
    ) as sensor:
        first = sensor.read()
    assert first.relative
    assert abs(first[HeightMap].mm).max() < 0.05


@pytest.fixture
def starting(lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Profile:
    """The lab's sensor, with a starting calibration and none of its unit."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    own = Bundle.load(lab.bundle)
    manifest = own.manifest.model_copy(update={"starting": Starting(of="another unit")})
    Bundle(manifest, own.artefacts, None).save(tmp_path / "start")
    return lab.profile.model_copy(update={"starting_bundle": tmp_path / "start"})


def test_an_uncalibrated_sensor_measures_relative_to_its_first_image_and_says_so(
    starting: Profile, lab: VirtualLab
) -> None:
    with open_sensor(starting, serial="0008", input=lab.presses) as sensor:
        first, second = sensor.read(), sensor.read()
    assert first.relative
    assert second.relative
    assert any("not calibrated" in note for note in sensor.notes)
    for reading in (first, second):
        assert any("another unit" in warning for warning in reading.warnings)
    assert first[HeightMap].mm.max() < 0.05 < second[HeightMap].mm.max()


def test_a_single_image_of_an_uncalibrated_sensor_needs_a_reference(
    starting: Profile, lab: VirtualLab
) -> None:
    with pytest.raises(InputError, match="a single image"):
        open_sensor(starting, input=lab.reference)


def test_a_recording_of_an_uncalibrated_sensor_is_measured_by_its_later_calibration(
    starting: Profile, lab: VirtualLab, tmp_path: Path
) -> None:
    """Relative to its reference, and not to the first image, which may show a contact."""
    with (
        open_sensor(starting, input=lab.presses) as sensor,
        sensor.record(tmp_path / "session.mcap", waits=True),
    ):
        coarse = [reading[HeightMap].mm.max() for reading in sensor.stream()]
    session = tmp_path / "session.mcap"
    own = Bundle.load(lab.bundle)
    with open_sensor(starting, input=session, bundle=own) as sensor:
        measured = [reading[HeightMap].mm.max() for reading in sensor.stream()]
    own.save(default_place(starting, None))
    with open_sensor(starting, input=session) as sensor:
        again = [reading[HeightMap].mm.max() for reading in sensor.stream()]
    with open_sensor(lab.profile_path, input=lab.presses, bundle=own) as sensor:
        expected = [reading[HeightMap].mm.max() for reading in sensor.stream()]
    np.testing.assert_allclose(measured, expected, rtol=1e-5)
    np.testing.assert_allclose(again, expected, rtol=1e-5)
    assert coarse[0] < 0.05 < expected[0]
    with pytest.raises(InputError, match="needs a reference"):
        calibrate(starting, session, ball_diameter_mm=BALL_MM)


def test_an_uncalibrated_sensor_takes_a_reference_that_is_given(
    starting: Profile, lab: VirtualLab
) -> None:
    with open_sensor(starting, input=lab.presses, reference=lab.reference) as sensor:
        first = sensor.read()
    assert not first.relative
    assert first[HeightMap].mm.max() > 0.05


def test_a_captured_reference_replaces_that_of_the_bundle(
    lab: VirtualLab, tmp_path_factory
) -> None:  # type: ignore[no-untyped-def]
    folder = tmp_path_factory.mktemp("steps")
    press = BallPress((70.0, 62.0), BALL_MM, 0.8)
    for i in range(4):
        lab.save(folder / f"{i}.png", press, seed=i)
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=folder) as sensor:
        reference = sensor.capture_reference(frames=3)
        after = sensor.read()
    assert reference.frames == 3
    assert abs(after[HeightMap].mm).max() < 0.05


def test_the_gel_selects_the_bundle(
    lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    bundle = Bundle.load(lab.bundle)
    manifest = bundle.manifest.model_copy(update={"gel_id": "G1"})
    place = default_place(lab.profile, "0007", "G1")
    Bundle(manifest, bundle.artefacts, bundle.reference).save(place)
    with open_sensor(lab.profile_path, serial="0007", gel="G1", input=lab.presses) as sensor:
        assert HeightMap in sensor.read()
    with pytest.raises(CalibrationError, match="not with gel G2"):
        open_sensor(lab.profile_path, serial="0007", gel="G2", bundle=place, input=lab.presses)
    with pytest.raises(InputError, match=r"gel 'a/b': use only letters"):
        open_sensor(lab.profile_path, gel="a/b", input=lab.presses)


def test_the_bundle_of_another_unit_is_rejected(lab: VirtualLab) -> None:
    with pytest.raises(CalibrationError, match="serial"):
        open_sensor(lab.profile_path, serial="1234", bundle=lab.bundle, input=lab.presses)


def test_an_image_of_another_size_is_resized_to_the_profile(lab: VirtualLab) -> None:
    # every frame has the size of the profile's image, 160 × 120
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.reference) as sensor:
        assert sensor.read().frame.pixels.shape == (120, 160, 3)


def test_without_input_the_replay_camera_asks_for_one(lab: VirtualLab) -> None:
    with pytest.raises(InputError, match="--input"):
        open_sensor(lab.profile_path, bundle=lab.bundle).read()


def test_a_reference_of_one_frame_has_no_noise_estimate(lab: VirtualLab) -> None:
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor:
        assert sensor.pipeline.reference is not None
        assert sensor.pipeline.reference.noise == 0
        assert np.isfinite(sensor.pipeline.reference.pixels).all()


class Jammed(DeviceError):
    """A camera that cannot be closed."""


class Box(LightDriver):
    """Records its calls."""

    def __init__(self, calls: list[str]) -> None:
        super().__init__(Options())
        self._calls = calls

    def _open(self) -> None:
        self._calls.append("open")

    def _close(self) -> None:
        self._calls.append("closed")

    def _set(self, levels: Mapping[str, float]) -> None:
        self._calls.append(" ".join(levels) or "dark")


@pytest.fixture
def lights(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The calls to the light driver of a sensor whose camera fails to close."""
    calls: list[str] = []

    def jam(camera: ReplayCamera) -> None:
        raise Jammed("the camera is jammed")

    monkeypatch.setattr(ReplayCamera, "_close", jam)
    monkeypatch.setattr(ReplayCamera, "live", True)
    monkeypatch.setattr(devices, "_make_driver", lambda profile: Box(calls))
    return calls


def test_the_lights_are_switched_off_even_if_the_camera_fails_to_close(
    lab: VirtualLab, lights: list[str]
) -> None:
    sensor = open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses)
    with pytest.raises(Jammed):
        sensor.close()
    assert lights == ["open", "dark", "dark", "dark", "closed"]
    sensor.close()


def test_an_error_within_the_block_is_not_hidden_by_one_of_closing(
    lab: VirtualLab, lights: list[str]
) -> None:
    sensor = open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses)
    with pytest.raises(ZeroDivisionError) as caught, sensor:
        raise ZeroDivisionError
    assert any("jammed" in note for note in caught.value.__notes__)
    assert lights[-2:] == ["dark", "closed"]


def test_a_failed_open_reports_its_cause_and_switches_the_lights_off(
    lab: VirtualLab, lights: list[str]
) -> None:
    with pytest.raises(CalibrationError, match="serial") as caught:
        open_sensor(lab.profile_path, serial="1234", bundle=lab.bundle, input=lab.presses)
    assert any("jammed" in note for note in caught.value.__notes__)
    assert lights == ["open", "dark", "dark", "dark", "closed"]


def test_a_scan_scale_with_impossible_marker_sizes_is_rejected(tmp_path: Path) -> None:
    write_png(tmp_path / "a.png", np.zeros((8, 8, 3), np.uint8))
    (tmp_path / "scan.yaml").write_text("images: [a.png]\nmmperpixel: 1e-6\n")
    with pytest.raises(InputError, match=r"gives a scale of .* has markers of .* px"):
        played_back(load_profile("hex_fingertip"), tmp_path)


def test_a_slow_camera_is_waited_for(lab: VirtualLab, monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []
    read = ReplayCamera._read

    def noted(self: ReplayCamera, timeout_s: float) -> object:
        waits.append(timeout_s)
        return read(self, timeout_s)

    monkeypatch.setattr(ReplayCamera, "_read", noted)
    with open_sensor(
        lab.profile_path, bundle=lab.bundle, input=lab.presses, reference="first", timeout_s=7.0
    ) as sensor:
        sensor.read()
        sensor.capture_reference(frames=2)
        next(sensor.stream())
        assert set(waits) == {7.0}
        sensor.read(timeout_s=2.0)
    assert waits[-1] == 2.0


def test_a_timeout_is_positive(lab: VirtualLab) -> None:
    with pytest.raises(InputError, match="positive number of seconds"):
        open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses, timeout_s=0)


def test_a_reading_has_the_warnings_of_the_health_that_concern_it(
    lab: VirtualLab, tmp_path: Path
) -> None:
    for number, gain in enumerate((1.0, 0.7, 0.7, 1.0)):
        write_png(tmp_path / f"{number}.png", (gain * lab.image(None, number)).astype(np.uint8))
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=tmp_path) as sensor:
        assert sensor.health().verdict == "unknown"
        dimmed, verdicts = [], []
        for reading in sensor.stream():
            dimmed.append(sum("dimmer than in the reference" in one for one in reading.warnings))
            verdicts.append(sensor.health().verdict)
            line = json.dumps(sensor.health().summary(), allow_nan=False)
    assert dimmed == [0, 3, 3, 0]
    assert verdicts == ["ok", "warning", "warning", "ok"]
    assert json.loads(line)["light red"]["verdict"] == "ok"
    assert json.loads(line)["rate"] == {
        "value": None,
        "expected": None,
        "unit": "Hz",
        "verdict": "unknown",
        "message": "a recording is read as fast as it is measured",
    }


def test_a_stream_says_which_unread_images_are_dropped(
    lab: VirtualLab, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen: list[object] = []
    monkeypatch.setattr(ReplayCamera, "set_drop", lambda camera, drop: chosen.append(drop))
    with open_sensor(
        lab.profile_path, bundle=lab.bundle, input=lab.presses, reference="first"
    ) as sensor:
        for drop in ("never", "oldest", None):
            next(sensor.stream(drop=drop))
        with pytest.raises(InputError, match="choose 'oldest' or 'never'"):
            next(sensor.stream(drop="newest"))
    assert chosen == ["never", "oldest", None]


def test_what_the_camera_notes_is_noted_by_the_sensor(
    lab: VirtualLab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ReplayCamera, "notes", ("it chose 25 images a second",))
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor:
        assert "it chose 25 images a second" in sensor.notes
