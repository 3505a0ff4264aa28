"""Playing a recording from its beginning again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.virtual_lab import VirtualLab

from tactile_core.errors import InputError
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.quantities import HeightMap


def test_a_recording_begins_again_with_equal_readings(lab: VirtualLab) -> None:
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor:
        first = sensor.read()
        list(sensor.stream())
        sensor.rewind()
        again = sensor.read()
    assert again.source == first.source
    np.testing.assert_array_equal(again[HeightMap].mm, first[HeightMap].mm)


def test_a_recorded_tare_and_reference_come_again(lab: VirtualLab, tmp_path: Path) -> None:
    pytest.importorskip("mcap", reason="the extra 'record' is not installed")
    path = tmp_path / "presses.mcap"
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor:
        sensor.read()
        with sensor.record(path):
            for _ in range(2):
                sensor.read()
            sensor.tare()
            sensor.read()
            sensor.capture_reference(2)
            sensor.read()
    with open_sensor(lab.profile_path, input=path) as sensor:
        first = list(sensor.stream())
        sensor.rewind()
        again = list(sensor.stream())
    assert len(first) == len(again) > 3
    for one, two in zip(first, again, strict=True):
        assert one.frame.sequence == two.frame.sequence
        np.testing.assert_array_equal(one[HeightMap].mm, two[HeightMap].mm)


def test_a_live_sensor_cannot_be_rewound(lab: VirtualLab, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses) as sensor:
        monkeypatch.setattr(Sensor, "is_live", True)
        with pytest.raises(InputError, match="is live"):
            sensor.rewind()
