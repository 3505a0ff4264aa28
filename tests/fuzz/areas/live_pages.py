"""Two pages at one sensor: what they begin is shown and ended, and everything saved is whole."""

from __future__ import annotations

import asyncio
import json
import threading
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

from fuzz.attempt import Attempt
from fuzz.sandbox import Sandbox


class Hidden(Exception):
    """Something goes on that no page shows, or was saved by half."""


def pages(box: Sandbox, rng: Random) -> Attempt:
    """Return a call that clicks on two pages at once, some of which are reloaded meanwhile."""
    recording = rng.random() < 0.4
    clicks = [[rng.choice(_CLICKS) for _ in range(rng.randrange(2, 6))] for _ in range(2)]
    reloads_s = [rng.choice((None, 0.0, 0.02, 0.2)) for _ in range(2)]
    return Attempt(call=lambda: _watched(recording, clicks, reloads_s), cpu_s=40, may_litter=True)


_CLICKS: tuple[dict[str, Any], ...] = (
    {"do": "snapshot"},
    {"do": "snapshot"},
    {"do": "record", "on": True},
    {"do": "record", "on": False},
    {"do": "calibrate", "on": True, "ball_diameter_mm": 3.0},
    {"do": "calibrate", "on": False},
    {"do": "finish"},
    {"do": "tare"},
    {"do": "reference", "frames": 2},
)


def _watched(
    recording: bool, clicks: list[list[dict[str, Any]]], reloads_s: list[float | None]
) -> None:
    from tactile_core.errors import TactileError
    from tactile_core.pipeline.opening import open_sensor
    from tactile_core.recordings.recording import open_recording
    from tactile_live.commands import read_command
    from tactile_live.desk import Desk
    from tactile_live.live_sensor import LiveSensor

    source: dict[str, Any] = {"input": "frames"} if recording else {"sim": True}
    sensor = open_sensor("small.yaml", bundle="bundle", reference="ref.png", **source)
    live = LiveSensor(sensor, Path("pages"))
    desk = Desk(live.start())
    faults: list[BaseException] = []

    async def click(words: dict[str, Any], reload_s: float | None) -> None:
        # a page that is reloaded waits for no answer
        with suppress(TimeoutError, TactileError, OSError):
            await asyncio.wait_for(desk.do(read_command(json.dumps(words))), reload_s or 20.0)

    def page(own: list[dict[str, Any]], reload_s: float | None) -> None:
        try:
            for words in own:
                asyncio.run(click(words, reload_s))
        except BaseException as error:
            faults.append(error)

    threads = [
        threading.Thread(target=page, args=one) for one in zip(clicks, reloads_s, strict=True)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with suppress(TactileError, OSError):
        asyncio.run(desk.do(read_command('{"do": "record", "on": false}')))
    shown = desk.status()
    if shown["recording"] is not None:
        raise Hidden("a recording goes on that no button ends")
    desk.close()
    for error in faults:
        raise error
    for path in Path("pages").glob("*.mcap"):
        open_recording(path)
    for thread in threading.enumerate():
        if thread.name.startswith("writer of"):
            raise Hidden("a recording goes on though the page has ended")
