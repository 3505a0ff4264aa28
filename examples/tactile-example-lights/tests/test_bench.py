from __future__ import annotations

import pytest
from tactile_example_lights.bench import DEPTH_MM, Bench

from tactile_core import ContactMask, DeviceError, HeightMap, Sensor, load_profile, open_sensor


@pytest.fixture
def bench() -> Bench:
    bench = Bench.at("loop")
    bench.lines.clear()
    return bench


def test_the_ball_is_measured_with_four_sequential_lights(bench: Bench) -> None:
    with open_sensor("example_lights_bench") as sensor:
        sensor.capture_reference(frames=1)
        reading = sensor.read()
    assert reading.frame.channels == ("east", "south", "west", "north")
    assert reading[HeightMap].mm.max() == pytest.approx(DEPTH_MM, rel=0.1)
    assert reading[ContactMask].mask.any()


def test_each_light_is_on_alone_then_none_and_all_are_off_at_the_end(bench: Bench) -> None:
    with open_sensor("example_lights_bench") as sensor:
        sensor.read()
    lit = [[w for w in line.split() if not w.endswith("=0")] for line in bench.lines]
    # the bench has no watchdog, so that a sensor begins with all lights off
    assert lit[:6] == [[], ["east=255"], ["south=255"], ["west=255"], ["north=255"], []]
    assert set(bench.brightness.values()) == {0}


def test_an_unknown_light_is_named_and_all_lights_are_switched_off(bench: Bench) -> None:
    lights = [
        {"name": name, "azimuth_deg": 120 * k, "elevation_deg": 45}
        for k, name in enumerate(("east", "up", "west"))
    ]
    profile = load_profile(
        "example_lights_bench", overrides={"illumination": {"lights": lights, "dark": False}}
    )
    with (
        pytest.raises(DeviceError, match="answers 'no light up'"),
        Sensor(profile).open() as sensor,
    ):
        sensor.read()
    assert set(bench.brightness.values()) == {0}


def test_a_camera_cannot_be_opened_twice() -> None:
    with (
        open_sensor("example_lights_bench"),
        pytest.raises(DeviceError, match="'loop' is already open in this process"),
    ):
        open_sensor("example_lights_bench")


def test_the_virtual_sensor_of_the_bench_needs_neither_camera_nor_box(bench: Bench) -> None:
    with open_sensor("example_lights_bench", sim=True) as sensor:
        assert sensor.read().frame.channels == ("east", "south", "west", "north")
    assert bench.lines == []
