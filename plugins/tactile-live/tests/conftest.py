"""A recording on a live page, and a browser that shows pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import Tab, chromium
from support.virtual_lab import VirtualLab
from support.watching import TOKEN, until

from tactile_core.pipeline.opening import open_sensor
from tactile_live.desk import Desk
from tactile_live.live_sensor import LiveSensor
from tactile_live.opening import WantedSensor, open_live
from tactile_live.server import LivePage

WIDE = {"width": 1280, "height": 900}


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
def virtual(lab: VirtualLab, tmp_path: Path) -> Iterator[Desk]:
    """A virtual sensor that a hand touches."""
    sensor = open_live(WantedSensor(str(lab.profile_path), bundle=lab.bundle), sim=True)
    made = Desk(LiveSensor(sensor, tmp_path).start())
    until(lambda: made.live.newest.value is not None)
    yield made
    made.close()


@pytest.fixture
def page(desk: Desk) -> Iterator[LivePage]:
    """The page of this recording."""
    with LivePage([desk], TOKEN) as served:
        yield served


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as opened:
        yield opened


@pytest.fixture
def new_tab(browser: Any) -> Iterator[Callable[..., Tab]]:
    contexts, tabs = [], []

    def make(**options: Any) -> Tab:
        context = browser.new_context(**{"viewport": WIDE, **options})
        contexts.append(context)
        tabs.append(Tab(context.new_page()))
        return tabs[-1]

    yield make
    for context in contexts:
        context.close()


@pytest.fixture(scope="module")
def fingertip(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    """A virtual fingertip of full size."""
    sensor = open_live(WantedSensor("hex_fingertip"), sim=True)
    desk = Desk(LiveSensor(sensor, tmp_path_factory.mktemp("out")))
    desk.live.start()
    yield desk
    desk.close()
