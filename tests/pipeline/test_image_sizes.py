"""A camera that changes the size of its images in mid-stream."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.virtual_lab import VirtualLab

from tactile_core.errors import DeviceError
from tactile_core.formats.images import write_png
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.loader import load_profile

CHANGE = r"images changed from 160 × 120 to 320 × 240 pixels; set the camera to one size"


def sent(folder: Path, number: int, width: int) -> None:
    """Put an image into the folder, as a program of the camera does."""
    pixels = np.full((width * 3 // 4, width, 3), 90 + number, np.uint8)
    write_png(folder / ".unfinished", pixels)
    (folder / ".unfinished").rename(folder / f"{number}.png")


def test_it_is_refused_and_what_was_recorded_can_be_played(lab: VirtualLab, tmp_path: Path) -> None:
    pytest.importorskip("mcap", reason="the extra 'record' is not installed")
    folder, path = tmp_path / "camera", tmp_path / "one.mcap"
    folder.mkdir()
    camera = {"use": "core.folder", "path": folder, "interval_s": 0.002}
    profile = load_profile(lab.profile_path, overrides={"camera": camera})
    with open_sensor(profile, reference=lab.reference, timeout_s=5.0) as sensor:
        recording = sensor.record(path)
        for number in range(3):
            sent(folder, number, 160)
            sensor.read()
        sent(folder, 3, 320)
        with pytest.raises(DeviceError, match=CHANGE):
            sensor.read()
        recording.close()
        assert recording.failure is not None
        assert f"{path} has ended" in recording.failure
        assert "from 160 × 120 to 320 × 240" in recording.failure
        sensor.close()
        sensor.open()  # as after an unplugged camera
        sent(folder, 4, 320)
        with pytest.raises(DeviceError, match=CHANGE):
            sensor.read()
    with open_sensor(lab.profile, input=path, reference=lab.reference) as replayed:
        assert len(list(replayed.stream())) == 3
