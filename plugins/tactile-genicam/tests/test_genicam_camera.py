"""A machine-vision camera over the real GigE Vision protocol, against Aravis's emulated camera."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.gige_camera import ADDRESS, OtherProcess, PaintedCamera, alone, missing

from tactile_core import claim_device, load_profile, open_sensor
from tactile_core.errors import CameraLost, CameraTimeout, DeviceError, InputError
from tactile_core.interfaces.camera import Trigger
from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.interfaces.illumination import Exposure
from tactile_core.pipeline.conversion import keep_recording
from tactile_core.testing.imports import Footprint
from tactile_genicam import camera as camera_module
from tactile_genicam import image_source
from tactile_genicam.camera import GenicamCamera, GenicamOptions
from tactile_genicam.image_source import PIXEL_FORMATS

PATIENCE_S = 20.0
WIDTH, HEIGHT = 128, 64

needs_aravis = pytest.mark.skipif(bool(missing()), reason=missing())


def camera_of(**options: object) -> GenicamCamera:
    return GenicamCamera(
        GenicamOptions.model_validate(
            {"address": ADDRESS, "region": (0, 0, WIDTH, HEIGHT), **options}
        )
    )


@pytest.fixture(autouse=True)
def _alone() -> Iterator[None]:
    pytest.importorskip("fcntl")
    with alone():
        yield


@pytest.fixture
def other() -> Iterator[OtherProcess]:
    with OtherProcess("TACT01") as process:
        yield process


@needs_aravis
def test_images_arrive_at_the_rate_and_size_of_the_profile(other: OtherProcess) -> None:
    camera = camera_of(serial="TACT01", fps=50, exposure_time_s=0.002, gain=1)
    camera.set_drop("never")
    with camera:
        images = [camera.read(PATIENCE_S) for _ in range(30)]
        rate_hz = camera.statistics.rate_hz
        assert camera.device_id == "TACT01"
    first = images[0]
    assert first is not None
    assert first.pixels.shape == (64, 128)
    assert first.pixels.dtype == np.uint8
    assert (first.exposure_time_s, first.gain) == (pytest.approx(0.002), 1)
    assert 0 <= time.monotonic() - first.timestamp_s < PATIENCE_S
    assert rate_hz == pytest.approx(50, rel=0.3)


@needs_aravis
def test_each_read_of_a_triggered_camera_shows_the_light_that_is_on() -> None:
    light = [0]
    painted = PaintedCamera("TACT02", lambda exposure_us: 10 + 40 * light[0], WIDTH * HEIGHT)
    exposures = [Exposure({f"light{i}": 1.0}, (f"light{i}",)) for i in range(5)]
    with painted, camera_of(trigger="software") as camera:
        assert camera.arm(exposures) is Trigger.SOFTWARE
        seen = []
        for _ in range(3):
            for light[0] in range(len(exposures)):
                image = camera.read(PATIENCE_S)
                assert image is not None
                seen.append((int(image.pixels[0, 0]) - 10) // 40)
        assert seen == [0, 1, 2, 3, 4] * 3


@needs_aravis
def test_a_triggered_camera_is_recorded_as_fast_as_it_takes_images(
    other: OtherProcess, tmp_path: Path
) -> None:
    profile = load_profile(
        "desktop_three_colour", overrides={"camera": {"address": ADDRESS, "trigger": "software"}}
    )
    with open_sensor(profile, timeout_s=PATIENCE_S) as sensor:
        began_s = time.monotonic()
        with sensor.record(tmp_path / "images") as recording:
            for _ in keep_recording(sensor, recording, frames=3, timeout_s=PATIENCE_S):
                pass
    assert recording.images == 3
    assert time.monotonic() - began_s < PATIENCE_S


@needs_aravis
def test_each_exposure_may_have_its_own_time() -> None:
    def paint(exposure_us: float) -> int:
        time.sleep(exposure_us / 1e6)
        return min(255, int(exposure_us / 100))

    painted = PaintedCamera("TACT03", paint, WIDTH * HEIGHT)
    exposures = [
        Exposure({"left": 1.0}, ("left",), exposure_time_s=0.005),
        Exposure({"right": 1.0}, ("right",), exposure_time_s=0.02),
    ]
    with painted, camera_of(trigger="software", exposure_time_s=0.001) as camera:
        camera.arm(exposures)
        images = [camera.read(PATIENCE_S) for _ in range(4)]
    assert [image.exposure_time_s for image in images if image] == [0.005, 0.02] * 2
    assert [int(image.pixels[0, 0]) for image in images if image] == [50, 200] * 2


@needs_aravis
@pytest.mark.parametrize("name", ["Mono8", "Mono16", "RGB8", "BayerRG8", "BayerGB8"])
def test_pixels_arrive_as_the_camera_sent_them(name: str) -> None:
    form = PIXEL_FORMATS[name]
    random = np.random.default_rng(0)
    sent = random.integers(0, 256, form.size(HEIGHT, WIDTH), np.uint8)
    with (
        PaintedCamera("TACT05", lambda _: sent, sent.nbytes),
        camera_of(trigger="software", pixel_format=name) as camera,
    ):
        camera.arm([Exposure({}, ("grey",))])
        image = camera.read(PATIENCE_S)
    assert image is not None
    np.testing.assert_array_equal(image.pixels, form.pixels(sent.tobytes(), HEIGHT, WIDTH))


@needs_aravis
def test_a_camera_that_waits_for_its_line_sends_nothing_by_itself(other: OtherProcess) -> None:
    exposures = [Exposure({f"light{i}": 1.0}, (f"light{i}",)) for i in range(3)]
    with camera_of(trigger="line", line="Line0", fps=100) as camera:
        assert camera.arm(exposures) is Trigger.CAMERA
        device = camera._camera.get_device()
        features = ("TriggerMode", "TriggerSelector", "TriggerSource")
        set_to = [device.get_string_feature_value(name) for name in features]
        assert set_to == ["On", "FrameStart", "Line0"]
        with pytest.raises(CameraTimeout):
            camera.read(0.2)


@needs_aravis
def test_a_camera_without_a_trigger_refuses_exposures_of_their_own(other: OtherProcess) -> None:
    with camera_of() as camera, pytest.raises(DeviceError, match="cannot change its exposure"):
        camera.arm([Exposure({"left": 1.0}, ("left",), exposure_time_s=0.005)])


@needs_aravis
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"serial": "TACT09"}, r"has the serial TACT01, not TACT09; correct 'camera.serial'"),
        ({"pixel_format": "BGR8"}, r"has no BGR8, only .*Mono8.*; correct 'camera.pixel_format'"),
        ({"exposure_time_s": 1e6}, r"does not take exposure_time_s: 1e\+06; it takes .* to .*, so"),
        ({"fps": 1e6}, r"does not take fps"),
    ],
)
def test_what_the_camera_refuses_is_one_sentence(
    other: OtherProcess, options: dict[str, object], message: str
) -> None:
    with pytest.raises(DeviceError, match=message):
        camera_of(**options).open()


@needs_aravis
def test_an_address_without_a_camera_is_an_error() -> None:
    with pytest.raises(DeviceError, match=r"cannot be opened: .*; check that no other program"):
        camera_of(address="127.0.0.9").open()


@needs_aravis
def test_a_stall_times_out_and_the_camera_goes_on(other: OtherProcess) -> None:
    with camera_of() as camera:
        assert camera.read(PATIENCE_S) is not None
        other.pause()
        try:
            with pytest.raises(CameraTimeout):
                [camera.read(0.3) for _ in range(1000)]
        finally:
            other.resume()
        assert camera.read(PATIENCE_S) is not None


@needs_aravis
def test_a_camera_that_is_unplugged_is_lost_and_found_again(other: OtherProcess) -> None:
    camera = camera_of()
    with camera:
        assert camera.read(PATIENCE_S) is not None
        other.kill()
        with pytest.raises(CameraLost, match="does not answer any more; check its cable"):
            [camera.read(PATIENCE_S) for _ in range(1000)]
    with OtherProcess("TACT01"), camera:
        assert camera.read(PATIENCE_S) is not None


@needs_aravis
def test_nothing_stays_behind(other: OtherProcess) -> None:
    camera = camera_of()
    with camera:
        camera.read(PATIENCE_S)
    before = Footprint.take_snapshot()
    for _ in range(3):
        with camera:
            camera.read(PATIENCE_S)
    assert before.find_leaks() == ""


def test_without_the_library_the_error_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "gi", None)
    monkeypatch.setattr(image_source, "_DEBIAN_PACKAGES", "/nowhere")
    with pytest.raises(DeviceError, match=r"sudo apt install gir1\.2-aravis-0\.8 python3-gi"):
        camera_of().open()


@needs_aravis
def test_a_connected_camera_is_listed_with_serial_and_address(other: OtherProcess) -> None:
    (found,) = [one for one in GenicamCamera.connected() if one.serial == "TACT01"]
    assert (found.place, found.usb_id, found.port_path) == (ADDRESS, None, None)
    assert "Aravis" in found.product


def test_without_aravis_what_libusb_finds_is_listed_and_the_library_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def no_aravis() -> None:
        raise DeviceError("genicam.camera needs the library Aravis")

    on_usb = ConnectedDevice("", "acA2440", "2676:ba02", "40012345", "2-1")
    monkeypatch.setattr(camera_module, "library", no_aravis)
    monkeypatch.setattr(camera_module, "usb_cameras", lambda _: iter([on_usb]))
    listed = GenicamCamera.connected()
    assert next(listed) == on_usb
    with pytest.raises(DeviceError, match="needs the library Aravis"):
        next(listed)


@needs_aravis
def test_a_unit_opens_the_camera_that_it_has_claimed_and_no_other_unit_does(
    other: OtherProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    (claimed,) = claim_device("R3", "TACT01")
    assert (claimed.use, claimed.unit) == ("genicam.camera", None)
    assert "desktop_three_colour" in claimed.profiles
    with open_sensor("desktop_three_colour", serial="R3", timeout_s=PATIENCE_S) as sensor:
        assert sensor.read().frame.pixels.shape == (480, 640, 3)
    with pytest.raises(InputError, match=r"camera of the unit 'R4' is not connected: .*to 'R3'; c"):
        open_sensor("desktop_three_colour", serial="R4")
    refused = load_profile("desktop_three_colour", overrides={"camera": {"exposure_time_s": 99}})
    with pytest.raises(DeviceError, match=r"TACT01 does not take exposure_time_s: 99; it takes"):
        open_sensor(refused, serial="R3")
