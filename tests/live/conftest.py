"""A recording on a live page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.virtual_lab import VirtualLab

pytest.importorskip("websockets", reason="the extra 'live' is not installed")

from support.watching import TOKEN, until

from tactile_core.live.desk import Desk
from tactile_core.live.live_sensor import LiveSensor
from tactile_core.live.server import LivePage
from tactile_core.pipeline.opening import open_sensor


@pytest.fixture
def desk(lab: VirtualLab, tmp_path: Path) -> Iterator[Desk]:
    """A recording of presses that plays as fast as it is measured, over and over."""
    sensor = open_sensor(lab.profile_path, bundle=lab.bundle, input=lab.presses)
    live = LiveSensor(sensor, tmp_path / "out")
    live.play(speed=0.0)
    made = Desk(live.start())
    until(lambda: live.newest.value is not None)
    yield made
    made.close()


@pytest.fixture
def page(desk: Desk) -> Iterator[LivePage]:
    """The page of this recording."""
    with LivePage([desk], TOKEN) as served:
        yield served
