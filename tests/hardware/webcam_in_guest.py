"""core.uvc with the kernel's own drivers: which camera, which settings, and every image."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from hardware.plugged import CAMERA, FIRST, FPS, HEIGHT, LIT, PROCESSING, WIDTH, number_of
from hardware.usbip_bus import Bus

from tactile_core.builtin.cameras.uvc_camera import UvcCamera, UvcOptions
from tactile_core.builtin.cameras.video_nodes import video_nodes
from tactile_core.errors import DeviceError
from tactile_core.interfaces.streaming import encoded_image
from tactile_core.testing.imports import Footprint

FRAMES = int(os.environ.get("TACTILE_FRAMES", "900"))
PATIENCE_S = 20.0


def camera_of(serial: str = FIRST, **options: object) -> UvcCamera:
    return UvcCamera(UvcOptions.model_validate({"serial": serial, **options}))


def delivered_by_the_kernel() -> int:
    """Images that the driver has taken from the first webcam since it was opened."""
    (device,) = (
        (node.entry / "device").resolve().parent for node in video_nodes() if node.serial == FIRST
    )
    bus, address = ((device / name).read_text().strip() for name in ("busnum", "devnum"))
    (stats,) = Path("/sys/kernel/debug/usb/uvcvideo").glob(f"{bus}-{address}-*/stats")
    return int(stats.read_text().split("frames:")[1].split()[0])


def hops(bus: Bus, camera: UvcCamera) -> np.ndarray:
    """Images that the first webcam sent whole and left out, the kernel and the queue received."""
    received = camera.statistics.received
    return np.array([*bus.ask(FIRST, "sent"), delivered_by_the_kernel(), received])


def test_each_camera_has_two_nodes_and_is_found_by_its_serial(bus: Bus) -> None:
    assert len(list(Path("/sys/class/video4linux").iterdir())) == 4
    assert [node.serial for node in video_nodes()] == [FIRST, LIT]
    for serial, shape in ((FIRST, (HEIGHT, WIDTH, 3)), (LIT, (128, 160, 3))):
        with camera_of(serial) as camera:
            image = camera.read(PATIENCE_S)
            assert image is not None
            assert image.pixels.shape == shape
            assert camera.device_id == serial


def test_two_cameras_without_a_choice_are_listed(bus: Bus) -> None:
    with pytest.raises(DeviceError, match=f"2 cameras match.*{FIRST}.*{LIT}"):
        UvcCamera(UvcOptions(usb_id="046d:081b")).open()


def test_every_image_that_the_camera_sent_is_read_in_order(
    bus: Bus, monkeypatch: pytest.MonkeyPatch
) -> None:
    # emulated processors decode eight images a second, and the claim is about acquisition
    monkeypatch.setattr(encoded_image, "decode_image", lambda *_: np.zeros((1, 1, 3), np.uint8))
    before = Footprint.take_snapshot()
    camera = camera_of(width_px=WIDTH, height_px=HEIGHT, fps=FPS)
    camera.set_drop("never")
    with camera:
        camera.read(PATIENCE_S)
        first = hops(bus, camera)
        images = [camera.read(PATIENCE_S) for _ in range(FRAMES)]
        sent, skipped, kernel, received = hops(bus, camera) - first
        statistics = camera.statistics
    encoded = [image.encoded or b"" for image in images if image is not None]
    numbers = np.array([number_of(jpeg) for jpeg in encoded])
    times = np.array([image.timestamp_s for image in images if image is not None])
    print(
        f"{WIDTH} × {HEIGHT} pixels, {np.mean([*map(len, encoded)]) / 1e3:.0f} kB an image: the "
        f"camera sent {sent} whole and left {skipped} out because the bus was too slow, the kernel "
        f"took {kernel}, the reader thread received {received}; {np.sum(np.diff(numbers) - 1)} of "
        f"{FRAMES} lost at {(FRAMES - 1) / (times[-1] - times[0]):.2f} Hz, longest gap "
        f"{1e3 * np.diff(times).max():.0f} ms",
        file=sys.stderr,
    )
    np.testing.assert_array_equal(np.diff(numbers), 1)
    assert (statistics.dropped, statistics.torn, statistics.repeated) == (0, 0, 0)
    assert np.all(np.diff(times) > 0)
    assert before.find_leaks() == ""


def test_settings_are_locked_in_the_camera_itself_and_read_back(bus: Bus) -> None:
    options = {"exposure_time_s": 0.02, "gain": 30, "white_balance_k": 5000}
    with camera_of(**options) as camera:
        image = camera.read(PATIENCE_S)
        assert image is not None
        assert image.exposure_time_s == pytest.approx(0.02)
        assert image.gain == 30
        assert bus.ask(FIRST, "control", CAMERA, 0x02) == 1  # manual
        assert bus.ask(FIRST, "control", CAMERA, 0x04) == 200
        assert bus.ask(FIRST, "control", PROCESSING, 0x04) == 30
        assert bus.ask(FIRST, "control", PROCESSING, 0x0A) == 5000
        assert bus.ask(FIRST, "control", PROCESSING, 0x0B) == 0
        assert "640 × 480 pixels, 30 images a second, MJPG" in camera.notes[0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"exposure_time_s": 2.0}, r"exposure_time_s: .* it takes 0.0001 to 0.5, so correct"),
        ({"focus": 3}, "has no control for focus"),
        ({"width_px": 1280, "height_px": 720}, r"chose width_px: 640 instead of 1280 with MJPG"),
        ({"fps": 60}, r"chose fps: 30 instead of 60"),
        ({"format": "YUYV"}, r"sends MJPG, not YUYV"),
    ],
)
def test_what_the_camera_refuses_is_one_sentence(
    bus: Bus, options: dict[str, object], message: str
) -> None:
    before = Footprint.take_snapshot()
    with pytest.raises(DeviceError, match=message):
        camera_of(**options).open()
    assert before.find_leaks() == ""
