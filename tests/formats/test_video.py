"""Videos give their frames with the times that the file carries."""

from __future__ import annotations

import os
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
    """Five red frames of rising brightness at 20 Hz."""
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (32, 16))
    for i in range(5):
        frame = np.zeros((16, 32, 3), np.uint8)
        frame[..., 2] = 40 * (i + 1)
        writer.write(frame)
    writer.release()
    return path


def test_frames_come_in_order_with_red_first(video: Path) -> None:
    frames = list(open_video(video).frames())
    assert len(frames) == 5
    for i, (pixels, _) in enumerate(frames):
        assert pixels.shape == (16, 32, 3)
        red, green, blue = pixels.reshape(-1, 3).mean(0)
        assert red == pytest.approx(40 * (i + 1), abs=4)
        assert max(green, blue) < 8


def test_times_are_the_file_s_own(video: Path) -> None:
    times = [time_s for _, time_s in open_video(video).frames()]
    np.testing.assert_allclose(times, np.arange(5) / 20, atol=1e-3)


def test_a_video_can_be_read_twice(video: Path) -> None:
    opened = open_video(video)
    assert len(list(opened.frames())) == len(list(opened.frames()))


def test_what_is_no_video_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "fake.avi"
    path.write_text("no video")
    with pytest.raises(InputError, match="no video"):
        open_video(path)
    with pytest.raises(InputError, match="no such file"):
        open_video(tmp_path / "absent.avi")


def test_a_real_video_is_read(recordings: Path) -> None:
    video = open_video(recordings / "markers" / "irregular_markers.avi")
    assert (video.kind.width_px, video.kind.height_px) == (960, 720)
    pixels, time_s = next(video.frames())
    assert (pixels.shape, time_s) == ((720, 960, 3), 0.0)


@pytest.mark.parametrize("name", ["http:v.avi", "file:v.avi", "v%03d.avi", "-i.avi", "ü.avi"])
def test_a_name_is_a_file_s_name_and_nothing_else(
    video: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    video.rename(video.parent / name)
    monkeypatch.chdir(video.parent)
    asked = []
    capture = cv2.VideoCapture
    monkeypatch.setattr(cv2, "VideoCapture", lambda *how: asked.append(how) or capture(*how))
    assert len(list(open_video(Path(name)).frames())) == 5
    # no protocol begins with a slash, and FFmpeg takes no other files for a pattern of videos
    assert set(asked) == {(str(video.parent / name), cv2.CAP_FFMPEG)}


def test_a_pattern_does_not_gather_other_files(video: Path) -> None:
    pattern = video.parent / "v%d.avi"
    video.rename(video.parent / "v0.avi")
    with pytest.raises(InputError, match="no such file"):
        open_video(pattern)
    pattern.write_text("no video")
    with pytest.raises(InputError, match="no video"):
        open_video(pattern)


def test_a_name_that_opencv_cannot_take_is_refused(video: Path) -> None:
    odd = video.rename(os.fsdecode(bytes(video.parent) + b"/\xff.avi"))
    with pytest.raises(InputError, match="rename"):
        open_video(odd)


def test_what_never_ends_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.avi")
    for endless in (tmp_path / "pipe.avi", Path("/dev/zero")):
        with pytest.raises(InputError, match="pipe or a device"):
            open_video(endless)
    with pytest.raises(InputError, match="is a folder"):
        open_video(tmp_path)


def test_an_empty_and_a_torn_video_are_refused_or_end_early(video: Path) -> None:
    data = video.read_bytes()
    for length in range(0, len(data), len(data) // 12):
        video.write_bytes(data[:length])
        with suppress(InputError):
            assert 0 < len(list(open_video(video).frames())) <= 5


def test_frames_beyond_the_limit_are_refused_before_one_is_decoded(
    video: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(formats_video, "MOST_PIXELS", 32 * 16 - 1)
    with pytest.raises(InputError, match="32 × 16 pixels"):
        open_video(video)
