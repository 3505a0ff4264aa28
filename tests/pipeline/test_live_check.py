"""Live observations that show the wrong light are dropped, and it is said."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import pytest
from support.height_lab import make_height_lab
from support.virtual_bench import (
    IMAGE,
    SixLights,
    Timing,
    VirtualCamera,
    VirtualLights,
    VirtualTime,
)

from tactile_core import open_sensor
from tactile_core.acquisition.acquisition import Acquisition, average
from tactile_core.builtin.sequential import ReplayCamera
from tactile_core.conditioning.conditioning import pattern_of, verify
from tactile_core.errors import SequenceError
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.frame_check import LiveCheck
from tactile_core.quantities import Frame


class Spoilt(VirtualLights):
    """Confuses two lights in the observations of these numbers."""

    spoilt: tuple[int, ...] = ()
    _begun = -1

    def _set(self, levels: Mapping[str, float]) -> None:
        self._begun += "led1" in levels
        self.swapped = {"led2": "led5"} if self._begun in self.spoilt else {}
        super()._set(levels)


def bench() -> tuple[Acquisition, Spoilt, Frame]:
    """Acquisition, lights, and the first observation."""
    time = VirtualTime()
    lights = Spoilt(time)
    camera = VirtualCamera(time, lights.open().scene, Timing()).open()
    acquisition = Acquisition(camera, SixLights(), IMAGE, lights, clock=time.clock)
    first = acquisition.observe()
    assert first is not None
    lights._begun = 0
    return acquisition, lights, first


def reading(frame: Frame) -> Reading:
    return Reading(frame, {}, {}, warnings=("already there",))


def test_a_spoilt_observation_is_dropped_and_the_next_reading_says_so() -> None:
    acquisition, lights, first = bench()
    assert acquisition.stamp_delay_s is not None
    check = LiveCheck(acquisition)
    lights.spoilt = (1,)
    good = partial(verify, expected=pattern_of(average([first])), what="observation 1")
    frame = check.observe(good, 1.0)
    assert frame is not None
    assert frame.sequence == 2
    assert (frame.pixels == first.pixels).all()
    there, dropped = check.add_warnings(reading(frame)).warnings
    assert there == "already there"
    assert "the exposure of light 'led2' shows light 'led5'" in dropped
    assert dropped.endswith("; it was dropped")
    assert check.add_warnings(reading(frame)).warnings == ("already there",)
    assert acquisition.stamp_delay_s is None  # from now on with the widest margin


def test_lights_that_stay_wrong_are_an_error() -> None:
    acquisition, lights, first = bench()
    lights.spoilt = tuple(range(1, 99))
    good = partial(verify, expected=pattern_of(average([first])), what="an observation")
    with pytest.raises(SequenceError, match=r"5 observations in succession .* as they are wired"):
        LiveCheck(acquisition).observe(good, 1.0)


def test_a_live_sensor_skips_a_spoilt_observation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lab").mkdir()
    lab = make_height_lab(tmp_path / "lab")
    for name in ("1", "2", "3"):
        shutil.copytree(lab.press, tmp_path / "played" / name)
    second = tmp_path / "played" / "2"
    first, other, *_ = sorted(second.iterdir())
    shutil.copy(other, first)
    monkeypatch.setattr(ReplayCamera, "live", True)
    with open_sensor(lab.profile, input=tmp_path / "played", reference=lab.undeformed) as sensor:
        readings = list(sensor.stream())
    assert [reading.source for reading in readings] == ["1", "3"]
    assert not any("dropped" in warning for warning in readings[0].warnings)
    assert "observation 2: the exposure of light" in readings[1].warnings[-1]
