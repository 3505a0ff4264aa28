"""When the images of a folder were taken, in readings."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.virtual_lab import VirtualLab

from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.loader import load_profile


@pytest.mark.parametrize("camera", ["core.uvc", "core.replay"])
def test_a_folder_is_played_at_the_frame_rate_of_the_profile(lab: VirtualLab, camera: str) -> None:
    chosen = {"use": camera, "fps": 25}
    profile = load_profile(lab.profile_path, overrides={"camera": chosen})
    with open_sensor(profile, input=lab.presses, bundle=lab.bundle) as sensor:
        times_s = [sensor.read().frame.timestamp_s for _ in range(3)]
    assert times_s == pytest.approx([0, 0.04, 0.08])


def test_a_folder_that_is_played_over_and_over_goes_on_in_time(
    lab: VirtualLab, tmp_path: Path
) -> None:
    for name, source in zip(("12.04", "12.2", "13"), sorted(lab.presses.iterdir()), strict=False):
        (tmp_path / f"{name}.png").write_bytes(source.read_bytes())
    chosen = {"use": "core.replay", "path": tmp_path, "loop": True}
    profile = load_profile(lab.profile_path, overrides={"camera": chosen})
    with open_sensor(profile, bundle=lab.bundle) as sensor:
        times_s = [sensor.read().frame.timestamp_s for _ in range(5)]
    assert times_s == pytest.approx([12.04, 12.2, 13, 13.8, 13.96])
