"""Health of a camera's stream."""

from __future__ import annotations

from typing import Any

import pytest

from tactile_core.acquisition.acquisition import Settings
from tactile_core.interfaces.camera import StreamStatistics
from tactile_core.pipeline.health_monitor import CameraHealth

RATE_HZ = 30.0


def stream(seconds: float = 5.0, **totals: Any) -> CameraHealth:
    """The health after a stream with these totals, half of them in the first half."""
    health = CameraHealth(live=True)
    nominal_hz = totals.pop("nominal_hz", None)
    age_s, measuring_s = totals.pop("age_s", 0.05), totals.pop("measuring_s", 0.02)
    exposures_s = totals.pop("exposures_s", (0.01, 0.01))
    totals = {"received": RATE_HZ * seconds, "rate_hz": RATE_HZ, **totals}
    for share, exposure_s in zip((0.0, 1.0), exposures_s, strict=True):
        counts = {k: int(share * v) for k, v in totals.items() if k != "rate_hz"}
        statistics = StreamStatistics(**counts, rate_hz=totals["rate_hz"])
        health.add(statistics, nominal_hz, [Settings(exposure_s, None)], share * seconds)
        health.add_reading(age_s, measuring_s)
    return health


def verdicts(health: CameraHealth) -> dict[str, str]:
    names = ("rate", "latency", "dropped", "torn", "repeated", "exposure_time")
    return {name: getattr(health, name)().verdict for name in names}


def test_a_healthy_stream_has_no_warning() -> None:
    health = stream(nominal_hz=30.0)
    assert set(verdicts(health).values()) == {"ok"}
    assert health.rate().value == RATE_HZ
    assert health.latency().value == pytest.approx(50.0)
    assert health.exposure_time().value == 0.01


@pytest.mark.parametrize(
    ("what", "totals", "sentence"),
    [
        ("rate", {"rate_hz": 15.0, "nominal_hz": 30.0}, "15.0 images arrive each second instead"),
        ("latency", {"age_s": 0.3}, "readings come 300 ms after mid-exposure, of which measuring"),
        ("dropped", {"dropped": 70, "measuring_s": 0.06}, "70 of 150 images were not measured"),
        ("torn", {"torn": 8}, "8 of 158 images arrived torn; change the cable"),
        ("repeated", {"repeated": 60}, "60 of 150 images repeat the one before"),
        ("exposure_time", {"exposures_s": (0.01, 0.02)}, "from 10.0 ms to 20.0 ms; write"),
    ],
)
def test_what_is_wrong_is_a_warning_that_says_what_to_do(
    what: str, totals: dict[str, Any], sentence: str
) -> None:
    health = stream(**totals)
    found = verdicts(health)
    assert found.pop(what) == "warning"
    assert set(found.values()) == {"ok"}
    message = getattr(health, what)().message
    assert sentence in message
    assert ";" in message


def test_a_shorter_exposure_is_a_change_as_well() -> None:
    finding = stream(exposures_s=(0.02, 0.01)).exposure_time()
    assert finding.verdict == "warning"
    assert "from 20.0 ms to 10.0 ms" in finding.message


def test_an_observation_under_six_lights_may_take_six_times_as_long() -> None:
    """Half an observation passes between its middle and its end, and each light waits for one."""

    def latency(lights: int) -> str:
        health = CameraHealth(live=True)
        settings = [Settings(0.01, None)] * lights
        for now_s in (0.0, 5.0):
            counts = StreamStatistics(received=int(30 * now_s), rate_hz=RATE_HZ)
            health.add(counts, None, settings, now_s)
            health.add_reading(0.4, 0.02)
        return health.latency().verdict

    assert latency(1) == "warning"
    assert latency(6) == "ok"


def test_a_camera_of_unknown_rate_is_compared_with_its_best() -> None:
    health = CameraHealth(live=True)
    for second in range(40):
        rate_hz = 900.0 if second == 0 else 25.0 if second < 20 else 12.0
        health.add(StreamStatistics(received=25 * second, rate_hz=rate_hz), None, (), second)
        if second == 0:
            assert health.rate().verdict == "unknown"  # two images that arrived together
    assert "12.0 images arrive each second instead of 25.0" in health.rate().message


@pytest.mark.parametrize("nominal_hz", [None, 25.0])
@pytest.mark.parametrize("hiccup_s", [1, 11, 20])
def test_images_that_were_held_up_and_arrive_in_a_burst_are_no_rate(
    nominal_hz: float | None, hiccup_s: int
) -> None:
    rates = dict.fromkeys(range(30), 25.0) | {hiccup_s: 12.0, hiccup_s + 1: 34.0}
    health = CameraHealth(live=True)
    for now_s, rate_hz in rates.items():
        statistics = StreamStatistics(received=25 * now_s, rate_hz=rate_hz)
        health.add(statistics, nominal_hz, (), now_s)
        assert health.rate().verdict in ("ok", "unknown")


def test_images_that_a_slow_reader_leaves_out_are_no_fault() -> None:
    dropped = stream(dropped=140).dropped()
    assert (dropped.value, dropped.verdict) == (140, "ok")


def test_a_single_torn_image_is_chance_only_in_many() -> None:
    assert stream(torn=1).torn().verdict == "ok"
    assert stream(torn=3).torn().verdict == "warning"


def test_old_faults_are_forgotten() -> None:
    health = CameraHealth(live=True)
    for now_s, received, torn in ((0.0, 0, 0), (5.0, 150, 50), (20.0, 600, 50), (29.0, 870, 50)):
        health.add(StreamStatistics(received, torn=torn, rate_hz=30.0), None, (), now_s)
    assert health.torn().value == 0


def test_a_camera_that_was_opened_again_is_counted_from_there() -> None:
    health = CameraHealth(live=True)
    for now_s, received, torn in ((0.0, 90, 40), (5.0, 150, 50), (6.0, 10, 0), (7.0, 40, 0)):
        health.add(StreamStatistics(received, torn=torn, rate_hz=30.0), None, (), now_s)
    assert (health.torn().value, health.torn().verdict) == (0, "ok")


@pytest.mark.parametrize("live", [True, False])
def test_without_a_stream_nothing_is_known_of_it(live: bool) -> None:
    health = CameraHealth(live=live)
    health.add(None, None, (), 0.0)
    health.add_reading(0.05, 0.02)
    assert set(verdicts(health).values()) == {"unknown"}
    reason = "takes its images on request" if live else "is read as fast as it is measured"
    assert reason in health.torn().message
    assert health.latency().value == (50.0 if live else None)
