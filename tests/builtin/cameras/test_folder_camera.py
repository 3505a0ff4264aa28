"""Images that another program puts into a folder."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.builtin.cameras.folder_camera import FolderCamera, FolderOptions
from tactile_core.errors import CameraLost, CameraTimeout, InputError
from tactile_core.formats.images import write_png
from tactile_core.interfaces.camera import Trigger
from tactile_core.interfaces.illumination import Exposure
from tactile_core.testing.imports import Footprint

PATIENCE_S = 20.0
NOTHING_S = 0.03


def image_of(value: int) -> np.ndarray:
    return np.full((4, 5, 3), value, np.uint8)


def encoded(value: int, suffix: str = ".png") -> bytes:
    return bytes(cv2.imencode(suffix, image_of(value))[1])


def camera_of(folder: Path, **options: object) -> FolderCamera:
    return FolderCamera(
        FolderOptions.model_validate({"path": folder, "interval_s": 0.002, **options})
    )


def value_of(camera: FolderCamera, timeout_s: float = PATIENCE_S) -> int:
    image = camera.read(timeout_s)
    assert image is not None
    return int(image.pixels[0, 0, 0])


@pytest.fixture
def camera(tmp_path: Path) -> Iterator[FolderCamera]:
    with camera_of(tmp_path) as camera:
        yield camera


def test_images_are_delivered_as_they_appear(camera: FolderCamera, tmp_path: Path) -> None:
    for value in range(3):
        write_png(tmp_path / f"press_{value}.png", image_of(value))
        image = camera.read(PATIENCE_S)
        assert image is not None
        assert (image.pixels == value).all()
        assert (image.sequence, image.source) == (value, f"press_{value}")
    with pytest.raises(CameraTimeout, match=r"the folder .* sent no image within 0.03 s"):
        camera.read(NOTHING_S)


@pytest.mark.parametrize("existing", [True, False])
def test_images_that_are_already_there_are_read_on_request(tmp_path: Path, existing: bool) -> None:
    write_png(tmp_path / "before.png", image_of(1))
    with camera_of(tmp_path, existing=existing) as camera:
        write_png(tmp_path / "during.png", image_of(2))
        assert value_of(camera) == (1 if existing else 2)


@settings(max_examples=8)
@given(st.permutations(range(1, 13)), st.sampled_from(["name", "mtime"]))
def test_images_that_are_found_together_are_in_the_chosen_order(
    tmp_path_factory: pytest.TempPathFactory, order: list[int], by: str
) -> None:
    folder = tmp_path_factory.mktemp("folder")
    for place, value in enumerate(order):
        path = folder / f"image{value}.png"
        path.write_bytes(encoded(value))
        os.utime(path, (1e9 + place, 1e9 + place))
    with camera_of(folder, order=by, existing=True) as camera:
        images = [camera.read(PATIENCE_S) for _ in order]
    values = [int(image.pixels[0, 0, 0]) for image in images if image is not None]
    assert values == (sorted(order) if by == "name" else order)
    times = [image.timestamp_s for image in images if image is not None]
    assert times == sorted(set(times))


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".bmp", ".ppm", ".tiff", ".webp"])
def test_a_half_written_file_is_awaited_and_later_ones_with_it(
    camera: FolderCamera, tmp_path: Path, suffix: str
) -> None:
    data = encoded(200, suffix)
    for part in (b"", data[: len(data) // 2], data[:-1]):
        (tmp_path / f"a{suffix}").write_bytes(part)
        write_png(tmp_path / "b.png", image_of(7))
        with pytest.raises(CameraTimeout):
            camera.read(NOTHING_S)
    (tmp_path / f"a{suffix}").write_bytes(data)
    assert abs(value_of(camera) - 200) <= 2
    assert value_of(camera) == 7
    assert camera.statistics.torn == 0


def test_the_rest_of_an_image_that_never_comes_is_not_awaited_forever(tmp_path: Path) -> None:
    with camera_of(tmp_path, patience_s=0.02) as camera:
        (tmp_path / "a.png").write_bytes(encoded(1)[:-5])
        write_png(tmp_path / "b.png", image_of(2))
        assert value_of(camera) == 2
        assert camera.statistics.torn == 1
        (tmp_path / "a.png").write_bytes(encoded(3))
        assert value_of(camera) == 3


def test_a_replaced_file_is_a_new_image_and_its_name_is_used_once(
    camera: FolderCamera, tmp_path: Path
) -> None:
    sources = []
    for value in range(3):
        write_png(tmp_path / "latest.png", image_of(value))
        image = camera.read(PATIENCE_S)
        assert image is not None
        assert image.pixels[0, 0, 0] == value
        sources.append(image.source)
    assert sources == ["latest", "", ""]


def test_only_visible_images_that_match_the_pattern_are_read(tmp_path: Path) -> None:
    with camera_of(tmp_path, pattern="left_*") as camera:
        write_png(tmp_path / "right_0.png", image_of(1))
        write_png(tmp_path / ".left_0.png", image_of(2))
        (tmp_path / "left_0.txt").write_text("not an image")
        (tmp_path / "left_1.png").mkdir()
        write_png(tmp_path / "left_2.png", image_of(3))
        assert value_of(camera) == 3
        with pytest.raises(CameraTimeout):
            camera.read(NOTHING_S)


def test_no_file_is_changed_or_deleted(tmp_path: Path) -> None:
    for value in range(3):
        (tmp_path / f"{value}.jpg").write_bytes(encoded(value, ".jpg"))
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in tmp_path.iterdir()}
    with camera_of(tmp_path, existing=True) as camera:
        images = [camera.read(PATIENCE_S) for _ in range(3)]
    after = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in tmp_path.iterdir()}
    assert after == before
    sent = [image.encoded for image in images if image is not None]
    assert sent == [before[tmp_path / f"{value}.jpg"][0] for value in range(3)]


def test_a_file_that_vanishes_before_it_is_complete_is_forgotten(
    camera: FolderCamera, tmp_path: Path
) -> None:
    (tmp_path / "a.png").write_bytes(b"\x89PNG")
    with pytest.raises(CameraTimeout):
        camera.read(NOTHING_S)
    (tmp_path / "a.png").unlink()
    write_png(tmp_path / "b.png", image_of(4))
    assert value_of(camera) == 4


def test_an_image_that_cannot_be_measured_ends_the_stream_with_its_name(
    camera: FolderCamera, tmp_path: Path
) -> None:
    cv2.imwrite(str(tmp_path / "depth.tiff"), np.zeros((4, 4), np.float32))
    with pytest.raises(InputError, match=r"depth.tiff contains float32 values"):
        camera.read(PATIENCE_S)


def test_a_folder_that_disappears_is_a_lost_camera(tmp_path: Path) -> None:
    folder = tmp_path / "mounted"
    folder.mkdir()
    with camera_of(folder) as camera:
        shutil.rmtree(folder)
        with pytest.raises(CameraLost, match="mounted has gone"):
            camera.read(PATIENCE_S)


def test_closing_does_not_wait_for_the_next_look(tmp_path: Path) -> None:
    before = Footprint.take_snapshot()
    began = time.monotonic()
    camera_of(tmp_path, interval_s=60.0).open().close()
    assert time.monotonic() - began < 30
    assert before.find_leaks() == ""


def test_a_missing_folder_is_refused_on_opening(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"correct 'camera\.path'"):
        camera_of(tmp_path / "nowhere").open()
    with pytest.raises(InputError, match="no folder to look into"):
        FolderCamera(FolderOptions()).open()


def test_the_lights_belong_to_the_program_that_writes_the_images(camera: FolderCamera) -> None:
    exposures = [Exposure({"left": 1.0}, ("left",)), Exposure({"right": 1.0}, ("right",))]
    assert camera.arm(exposures) is Trigger.CAMERA
    assert not camera.live
