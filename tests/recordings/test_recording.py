"""Recordings of every kind are read as a sequence of observations."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.images import write_png
from tactile_core.recordings import recording as recording_module
from tactile_core.recordings.recording import Recording, open_recording


def picture(path: Path, value: int = 0, shape: tuple[int, ...] = (6, 8, 3)) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, np.full(shape, value, np.uint8))
    return path


def scan(folder: Path, images: int = 6, text: str = "", shape: tuple[int, ...] = (6, 8)) -> Path:
    names = [f"image{i:02d}.png" for i in range(images)]
    for i, name in enumerate(names):
        picture(folder / name, i, shape)
    (folder / "scan.yaml").write_text(f"images: [{', '.join(names)}]\n{text}")
    return folder


def names(recording: Recording) -> list[str]:
    return [observation.name for observation in recording]


def values(recording: Recording) -> list[list[int]]:
    """Return the first pixel of each image of each observation."""
    return [[int(image.pixels.flat[0]) for image in one.images] for one in recording]


def refusal(path: Path, count: int = 1) -> str:
    with pytest.raises(InputError) as caught:
        list(open_recording(path, images_per_observation=count))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_one_image_is_one_observation(tmp_path: Path) -> None:
    recording = open_recording(picture(tmp_path / "press.v2.png", 7))
    assert names(recording) == ["press.v2"]
    assert values(recording) == [[7]]
    assert (recording.count, recording.size_px) == (1, (8, 6))
    assert (recording.mm_per_px, recording.crop) == (None, None)


def test_a_folder_is_read_in_natural_order_of_names(tmp_path: Path) -> None:
    for number in (10, 2, 1):
        picture(tmp_path / f"ball-{number}.png", number)
    (tmp_path / "labels.csv").write_text("not an image")
    (tmp_path / ".hidden.png").write_text("not an image")
    recording = open_recording(tmp_path)
    assert names(recording) == ["ball-1", "ball-2", "ball-10"]
    assert values(recording) == [[1], [2], [10]]


def test_images_without_times_come_at_the_given_rate(tmp_path: Path) -> None:
    for number in range(3):
        picture(tmp_path / f"{number}.png", number)
    assert times(open_recording(tmp_path).with_rate(25)) == pytest.approx([0, 0.04, 0.08])
    assert times(open_recording(tmp_path)) == pytest.approx([0, 1 / 30, 2 / 30])


def test_names_that_are_times_time_the_images(tmp_path: Path) -> None:
    for level, name in enumerate(("12.04", "12.2", "14")):
        picture(tmp_path / f"{name}.png", level)
    recording = open_recording(tmp_path).with_rate(25)
    assert values(recording) == [[0], [1], [2]]
    assert times(recording) == pytest.approx([12.04, 12.2, 14])


def times(recording: Recording) -> list[float]:
    return [image.timestamp_s for one in recording for image in one.images]


def test_each_iteration_starts_from_the_beginning(tmp_path: Path) -> None:
    picture(tmp_path / "a.png")
    recording = open_recording(tmp_path)
    assert names(recording) == names(recording) == ["a"]


def test_images_are_numbered_and_timed_at_30_hz(tmp_path: Path) -> None:
    images = [
        image
        for one in open_recording(scan(tmp_path / "s"), images_per_observation=6)
        for image in one.images
    ]
    assert [image.sequence for image in images] == list(range(6))
    np.testing.assert_allclose([image.timestamp_s for image in images], np.arange(6) / 30)
    assert {image.source for image in images} == {"s"}


@pytest.mark.parametrize("named", [".", "scan.yaml"])
def test_a_scan_is_one_observation_and_other_images_are_ignored(tmp_path: Path, named: str) -> None:
    folder = scan(tmp_path / "scan07", text="mmperpixel: 0.02\ncrop: [1, 2, 3, 4]\n")
    picture(folder / "thumbnail.png", 99, (2, 2, 3))
    recording = open_recording(folder / named, images_per_observation=6)
    assert names(recording) == ["scan07"]
    assert values(recording) == [[0, 1, 2, 3, 4, 5]]
    assert (recording.mm_per_px, recording.crop) == (0.02, (1, 2, 3, 4))


def test_a_scan_without_scale_or_crop_leaves_them_unknown(tmp_path: Path) -> None:
    scan(tmp_path, 1, "mmperpixel: 0\ncrop: [0, 0, 0, 0]\n")
    recording = open_recording(tmp_path)
    assert (recording.mm_per_px, recording.crop) == (None, None)


def test_a_folder_of_scans_has_one_observation_per_scan(tmp_path: Path) -> None:
    scan(tmp_path / "s10", 2, "mmperpixel: 0.02\n")
    scan(tmp_path / "s9", 2, "mmperpixel: 0\n")
    picture(tmp_path / "overview.png", 0, (3, 3))
    recording = open_recording(tmp_path, images_per_observation=2)
    assert names(recording) == ["s9", "s10"]
    assert recording.mm_per_px == 0.02


def test_scans_of_different_scale_or_crop_are_rejected(tmp_path: Path) -> None:
    scan(tmp_path / "a", 1, "mmperpixel: 0.02\n")
    scan(tmp_path / "b", 1, "mmperpixel: 0.0203\n")
    assert "0.02 mm per pixel" in refusal(tmp_path)
    scan(tmp_path / "a", 1, "crop: [0, 0, 4, 4]\n")
    scan(tmp_path / "b", 1, "crop: [1, 0, 4, 4]\n")
    assert "crop" in refusal(tmp_path)


def test_a_folder_with_one_image_per_light_is_one_observation(tmp_path: Path) -> None:
    for i in range(6):
        picture(tmp_path / "press" / f"{i}.png", i, (6, 8))
    recording = open_recording(tmp_path / "press", images_per_observation=6)
    assert names(recording) == ["press"]
    assert values(recording) == [[0, 1, 2, 3, 4, 5]]
    parent = open_recording(tmp_path, images_per_observation=6)
    assert names(parent) == ["press"]


@pytest.mark.parametrize("count", [5, 7, 12])
def test_any_other_number_of_images_is_an_error(tmp_path: Path, count: int) -> None:
    for i in range(count):
        picture(tmp_path / "press" / f"{i:02d}.png")
    assert f"{count} images, but the rig takes 6" in refusal(tmp_path / "press", 6)
    assert f"{count} images, but the rig takes 6" in refusal(tmp_path, 6)
    assert "the rig takes 6" in refusal(scan(tmp_path / "scan", count), 6)
    assert "the rig takes 6" in refusal(tmp_path / "press" / "00.png", 6)
    assert "the rig takes 1" in refusal(tmp_path / "scan", 1)


@pytest.fixture
def video(tmp_path: Path) -> Path:
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (32, 16))
    for _ in range(3):
        writer.write(np.zeros((16, 32, 3), np.uint8))
    writer.release()
    return path


def test_video_frames_are_numbered_and_timed(video: Path) -> None:
    recording = open_recording(video)
    assert names(recording) == ["clip_000000", "clip_000001", "clip_000002"]
    assert recording.count is None
    assert recording.size_px == (32, 16)
    times = [observation.images[0].timestamp_s for observation in recording]
    np.testing.assert_allclose(times, [0, 0.05, 0.1], atol=1e-3)


def test_images_of_different_kinds_are_rejected_with_both_names(tmp_path: Path) -> None:
    picture(tmp_path / "a.png")
    picture(tmp_path / "b.png")
    different = picture(tmp_path / "c.png", 0, (6, 9, 3))
    message = refusal(tmp_path)
    assert "a.png is 8 × 6 RGB, 8 bits" in message
    assert "c.png is 9 × 6 RGB, 8 bits" in message
    picture(different, 0, (6, 8))
    assert "c.png is 8 × 6 grey" in refusal(tmp_path)
    write_png(different, np.zeros((6, 8, 3), np.uint16))
    assert "c.png is 8 × 6 RGB, 16 bits" in refusal(tmp_path)


def test_an_unreadable_image_is_detected_on_opening(tmp_path: Path) -> None:
    picture(tmp_path / "a.png")
    (tmp_path / "b.png").write_text("this is not an image")
    with pytest.raises(InputError, match="not a readable image"):
        open_recording(tmp_path)


def test_files_whose_results_would_share_a_name_are_rejected(tmp_path: Path) -> None:
    picture(tmp_path / "a.png")
    cv2.imwrite(str(tmp_path / "a.jpg"), np.zeros((6, 8, 3), np.uint8))
    assert "the same name" in refusal(tmp_path)


def test_a_folder_without_images_is_rejected_with_its_content(tmp_path: Path, video: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert "it is empty" in refusal(tmp_path / "empty")
    assert "no such file" in refusal(tmp_path / "absent")
    assert "clip.avi" in refusal(tmp_path)
    picture(tmp_path / "above" / "presses" / "a.png")
    assert "presses" in refusal(tmp_path / "above")
    (tmp_path / "empty" / "notes.txt").write_text("hello")
    assert "notes.txt" in refusal(tmp_path / "empty")
    assert "not a readable image" in refusal(tmp_path / "empty" / "notes.txt")


def test_a_missing_image_of_a_scan_is_named(tmp_path: Path) -> None:
    (scan(tmp_path / "s", 2) / "image01.png").unlink()
    assert "image01.png" in refusal(tmp_path / "s", 2)


def test_recorded_data_of_every_kind_opens(recordings: Path) -> None:
    grid = open_recording(recordings / "six_led/ball_grid", images_per_observation=6)
    assert (grid.count, grid.size_px) == (3, (2448, 2048))
    assert grid.mm_per_px == pytest.approx(0.0034035, abs=1e-7)
    assert [f.name for f in grid.files] == ["BGA-001", "BGA-002", "Flat-001"]
    penny = open_recording(recordings / "three_colour/penny")
    assert (penny.count, penny.crop) == (1, (567, 229, 902, 828))
    presses = open_recording(recordings / "three_colour/objectfolder/presses")
    assert names(presses) == [f"press_{i:02d}" for i in range(20)]
    assert open_recording(recordings / "markers/irregular_markers.avi").size_px == (960, 720)


def test_linked_scans_keep_the_names_of_their_links(tmp_path: Path) -> None:
    folder = tmp_path / "all"
    folder.mkdir()
    for one in ("a", "b"):
        (folder / one).symlink_to(scan(tmp_path / one / "scan001", 1, shape=(6, 8, 3)))
    assert names(open_recording(folder)) == ["a", "b"]


def test_a_scan_is_named_after_its_folder_for_any_path_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside = scan(tmp_path / "scan001", 1, shape=(6, 8, 3)) / "deeper"
    inside.mkdir()
    for place, path in [(inside.parent, "."), (inside.parent, "scan.yaml"), (inside, "..")]:
        monkeypatch.chdir(place)
        assert names(open_recording(path)) == ["scan001"]


def test_an_image_outside_the_scan_folder_is_rejected(tmp_path: Path) -> None:
    picture(tmp_path / "x.png")
    folder = scan(tmp_path / "scan", 1)
    (folder / "scan.yaml").write_text("images: ['../x.png']\n")
    assert "is outside it" in refusal(folder)


def test_pipes_and_devices_are_rejected(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for name in ("pipe.png", "pipe.avi", "pipe.yaml", "in/pipe.png"):
        os.mkfifo(tmp_path / name)
    for path in (tmp_path / "pipe.png", tmp_path / "pipe.avi", tmp_path / "pipe.yaml"):
        assert "pipe or a device" in refusal(path)
    assert "pipe or a device" in refusal(Path("/dev/zero"))
    assert "has no images" in refusal(tmp_path / "in")


@pytest.mark.parametrize("name", ["x" * 300, "x" * 300 + ".png", "a\0.png", "absent.png/b.png"])
def test_an_invalid_file_name_is_rejected(tmp_path: Path, name: str) -> None:
    picture(tmp_path / "absent.png")
    assert refusal(tmp_path / name)


def test_a_file_name_that_is_not_utf8_is_read(tmp_path: Path) -> None:
    path = Path(os.fsdecode(bytes(tmp_path) + b"/\xff.png"))
    assert names(open_recording(picture(path, 3))) == ["\udcff"]
    path.write_bytes(b"")
    with pytest.raises(InputError):
        open_recording(path)


def test_a_catalogue_lists_the_folders_of_a_recording(tmp_path: Path) -> None:
    picture(tmp_path / "background.png", 9)
    for number in (2, 1, 3):
        picture(tmp_path / f"ball/{number}/gelsight.png", number)
    picture(tmp_path / "ball/1/label.png", 8)
    (tmp_path / "catalog.csv").write_text(
        "experiment_reldir,diameter(mm)\nball/2,4\nball/1,6\n", encoding="utf-8"
    )
    recording = open_recording(tmp_path)
    assert names(recording) == ["ball_2", "ball_1"]
    assert values(recording) == [[2], [1]]


def test_a_folder_of_a_catalogue_may_hold_many_images(tmp_path: Path) -> None:
    for number in (2, 1):
        picture(tmp_path / f"ball4/{number}.png", number)
    (tmp_path / "catalog.csv").write_text("experiment_reldir,diameter(mm)\nball4,4\n")
    assert names(open_recording(tmp_path)) == ["ball4_1", "ball4_2"]


def test_a_catalogue_of_sequential_lights_lists_observations(tmp_path: Path) -> None:
    for light in range(3):
        picture(tmp_path / f"press/{light}.png", light)
    (tmp_path / "catalog.csv").write_text("experiment_reldir,diameter(mm)\npress,4\n")
    assert values(open_recording(tmp_path, images_per_observation=3)) == [[0, 1, 2]]
    assert "exactly 2" in refusal(tmp_path, 2)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("press.npy", "an array file; save its images as PNG"),
        ("press.bag", "a ROS bag; extract its images"),
        ("press.hdf5", "HDF5 of another program"),
        ("press.zip", "an archive; unpack it"),
    ],
)
def test_a_file_that_no_recording_can_be_is_named_for_what_it_is(
    tmp_path: Path, name: str, sentence: str
) -> None:
    (tmp_path / name).write_bytes(b"content")
    for path in (tmp_path / name, tmp_path):
        with pytest.raises(InputError, match=sentence):
            open_recording(path)


def test_an_mcap_file_of_another_program_is_named_for_what_it_is(tmp_path: Path) -> None:
    from mcap.writer import Writer

    with (tmp_path / "robot.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/joints", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(InputError, match=r"no MCAP recording of tactile.* save another program's"):
        open_recording(tmp_path / "robot.mcap")


def test_of_very_many_images_some_are_checked_before_the_first_and_all_as_they_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording_module, "_CHECKED", 3)
    for number in range(12):
        shape = (5, 7, 3) if number != 10 else (7, 5, 3)
        write_png(tmp_path / f"f{number}.png", np.zeros(shape, np.uint8))
    found = iter(open_recording(tmp_path))
    assert [next(found).name for _ in range(10)] == [f"f{number}" for number in range(10)]
    with pytest.raises(
        InputError, match=r"f10\.png is 5 × 7 .*, but the recording began with 7 × 5"
    ):
        next(found)


def test_a_name_that_is_too_long_is_refused_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="too long"):
        open_recording(tmp_path / ("x" * 300))
