"""Frames of videos and their timestamps."""

from __future__ import annotations

import os
import struct
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats import video as formats_video
from tactile_core.formats.video import open_video


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """Five red frames of increasing brightness at 20 Hz."""
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (32, 16))
    for i in range(5):
        frame = np.zeros((16, 32, 3), np.uint8)
        frame[..., 2] = 40 * (i + 1)
        writer.write(frame)
    writer.release()
    return path


def test_frames_are_in_order_and_rgb(video: Path) -> None:
    frames = list(open_video(video).frames())
    assert len(frames) == 5
    for i, (pixels, _) in enumerate(frames):
        assert pixels.shape == (16, 32, 3)
        red, green, blue = pixels.reshape(-1, 3).mean(0)
        assert red == pytest.approx(40 * (i + 1), abs=4)
        assert max(green, blue) < 8


def test_timestamps_are_those_of_the_file(video: Path) -> None:
    times = [time_s for _, time_s in open_video(video).frames()]
    np.testing.assert_allclose(times, np.arange(5) / 20, atol=1e-3)


def test_a_video_can_be_read_twice(video: Path) -> None:
    opened = open_video(video)
    assert len(list(opened.frames())) == len(list(opened.frames()))


def test_files_that_are_not_videos_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "fake.avi"
    path.write_text("not a video")
    with pytest.raises(InputError, match="not a readable video"):
        open_video(path)
    with pytest.raises(InputError, match="no such file"):
        open_video(tmp_path / "absent.avi")


def test_a_recorded_video_is_read(recordings: Path) -> None:
    video = open_video(recordings / "markers" / "irregular_markers.avi")
    assert (video.kind.width_px, video.kind.height_px) == (960, 720)
    pixels, time_s = next(video.frames())
    assert (pixels.shape, time_s) == ((720, 960, 3), 0.0)


@pytest.mark.parametrize("name", ["http:v.avi", "file:v.avi", "v%03d.avi", "-i.avi", "ü.avi"])
def test_a_name_is_never_taken_for_a_url_or_a_pattern(
    video: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    video.rename(video.parent / name)
    monkeypatch.chdir(video.parent)
    calls = []
    capture = cv2.VideoCapture
    monkeypatch.setattr(cv2, "VideoCapture", lambda *args: calls.append(args) or capture(*args))
    assert len(list(open_video(Path(name)).frames())) == 5
    # an absolute path cannot be a URL, and FFmpeg does not expand patterns in it
    assert set(calls) == {(str(video.parent / name), cv2.CAP_FFMPEG)}


def test_a_pattern_does_not_match_other_files(video: Path) -> None:
    pattern = video.parent / "v%d.avi"
    video.rename(video.parent / "v0.avi")
    with pytest.raises(InputError, match="no such file"):
        open_video(pattern)
    pattern.write_text("not a video")
    with pytest.raises(InputError, match="not a readable video"):
        open_video(pattern)


def test_a_name_that_is_not_utf8_is_rejected(video: Path) -> None:
    renamed = video.rename(os.fsdecode(bytes(video.parent) + b"/\xff.avi"))
    with pytest.raises(InputError, match="rename"):
        open_video(renamed)


def test_pipes_devices_and_folders_are_rejected(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.avi")
    for endless in (tmp_path / "pipe.avi", Path("/dev/zero")):
        with pytest.raises(InputError, match="pipe or a device"):
            open_video(endless)
    with pytest.raises(InputError, match="is a folder"):
        open_video(tmp_path)


def test_empty_and_truncated_videos_are_rejected_or_end_early(video: Path) -> None:
    data = video.read_bytes()
    for length in range(0, len(data), len(data) // 12):
        video.write_bytes(data[:length])
        with suppress(InputError):
            assert 0 < len(list(open_video(video).frames())) <= 5


def test_oversized_frames_are_rejected_before_decoding(
    video: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(formats_video, "MAX_PIXELS", 32 * 16 - 1)
    with pytest.raises(InputError, match="32 × 16 pixels"):
        open_video(video)


def test_a_video_that_says_how_to_turn_it_is_read_as_stored(tmp_path: Path) -> None:
    path = tmp_path / "turned.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 10, (64, 48))
    for _ in range(3):
        writer.write(np.full((48, 64, 3), 90, np.uint8))
    writer.release()
    data = bytearray(path.read_bytes())
    matrix = data.find(b"tkhd") + 44
    one = 1 << 16
    data[matrix : matrix + 36] = struct.pack(">9i", 0, one, 0, -one, 0, 0, 48 * one, 0, 1 << 30)
    path.write_bytes(data)
    found = open_video(path)
    assert (found.kind.width_px, found.kind.height_px) == (64, 48)
    assert {pixels.shape for pixels, _ in found.frames()} == {(48, 64, 3)}


@pytest.mark.parametrize(("ending", "codec"), [("flv", "FLV1"), ("wmv", "WMV2")])
def test_every_container_that_ffmpeg_reads_is_a_video(
    tmp_path: Path, ending: str, codec: str
) -> None:
    assert f".{ending}" in formats_video.VIDEO_SUFFIXES
    path = tmp_path / f"clip.{ending}"
    writer = cv2.VideoWriter(
        str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*codec), 20.0, (64, 48)
    )
    for value in (40, 90, 140):
        writer.write(np.full((48, 64, 3), value, np.uint8))
    writer.release()
    found = [int(pixels.mean()) for pixels, _ in open_video(path).frames()]
    assert found == pytest.approx([40, 90, 140], abs=9)
