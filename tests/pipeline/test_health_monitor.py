"""What a health monitor says with each reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactile_core.interfaces.camera import StreamStatistics
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.health_monitor import HealthMonitor
from tactile_core.quantities import Frame


class Repeating:
    """A camera that repeats every third image."""

    live = True
    nominal_rate_hz = 30.0
    statistics = StreamStatistics(rate_hz=30.0)

    def goes_on(self, images: int) -> None:
        before = self.statistics
        self.statistics = replace(
            before, received=before.received + images, repeated=before.repeated + images // 3
        )


def test_a_warning_keeps_its_words_until_its_value_has_changed_by_half() -> None:
    camera = Repeating()
    monitor = HealthMonitor(camera)  # type: ignore[arg-type]
    frame = Frame(np.zeros((4, 6, 3), np.uint8), ("r", "g", "b"), 0.1, source="lift")
    said = []
    for step in range(100):
        monitor.add(Reading(frame, {}, {}), (), step / 10)
        camera.goes_on(3)
        said += [one for one in monitor.warnings() if "repeat" in one]
    assert len(said) > 90
    assert len(set(said)) < 10
    values = [int(one.split()[0]) for one in dict.fromkeys(said)]
    assert values[-1] > monitor.health().repeated.value / 1.6  # type: ignore[operator]
    assert values == pytest.approx(sorted(values))
