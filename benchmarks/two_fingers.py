"""Frames per second of two virtual fingers on two cores: ``python benchmarks/two_fingers.py``.

Each finger is a process with one thread that measures every step of the profile. First both measure
frames that were rendered before: the chain alone. Then both render each frame as well, as in
``open_sensor(profile, sim=True)``. Frames per second are of elapsed time, so that they hold only on
a machine that does nothing else; ms of processor time per frame depend less on other load.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Generator
from contextlib import ExitStack
from itertools import cycle, islice

from tactile_core import Bundle, load_profile, open_sensor
from tactile_core.calibration.virtual_unit import calibrate_virtual_unit
from tactile_core.evaluation.own_resources import one_thread
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.workers import WorkerProcess

WARM_UP, RENDERED = 40, 40
"""Frames before timing starts, and frames that are rendered before."""

VIRTUAL = {"camera": {"use": "sim.virtual", "loop": True}}
"""The default script, which presses, shears, twists and releases a ball, again and again."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("profile", nargs="?", default="hex_fingertip")
    parser.add_argument("--fingers", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()
    profile = load_profile(given.profile, sim=True, overrides=VIRTUAL)
    bundle = calibrate_virtual_unit(profile)
    image = profile.image
    print(f"{profile.name}, {image.width_px} × {image.height_px}, load {os.getloadavg()[0]:.1f}")
    # another process cannot import __main__
    from two_fingers import chain, measured, rendering

    for words, finger in (("chain alone", chain), ("with rendering", rendering)):
        with ExitStack() as stack:
            fingers = [
                stack.enter_context(WorkerProcess(measured, finger, profile, bundle))
                for _ in range(given.fingers)
            ]
            for one in fingers:
                one.receive()  # warm
            for one in fingers:
                one.send(given.seconds)
            figures = [one.receive() for one in fingers]
        shown = ", ".join(f"{rate:.1f} fps at {ms:.1f} ms" for rate, ms in figures)
        print(f"{words}: {shown} of processor time per frame")


def measured(
    finger: Callable[..., Generator[None, None, None]], *unit: object
) -> Generator[tuple[float, float] | None, float, None]:
    """Frames per second, and ms of processor time per frame, over as many seconds as asked for."""
    with one_thread():
        frames = finger(*unit)
        for _ in islice(frames, WARM_UP):
            pass
        seconds = yield None
        while True:
            count, start, used = 0, time.perf_counter(), time.process_time()
            while (elapsed := time.perf_counter() - start) < seconds:
                next(frames)
                count += 1
            seconds = yield count / elapsed, 1e3 * (time.process_time() - used) / count


def chain(profile, bundle: Bundle) -> Generator[None, None, None]:
    """Measure frames that were rendered before."""
    with open_sensor(profile, bundle=bundle, sim=True) as sensor:
        rendered = [sensor.acquire() for _ in range(RENDERED)]
    pipeline = Pipeline(profile, bundle)
    for frame in cycle(rendered):
        pipeline.process(frame)
        yield


def rendering(profile, bundle: Bundle) -> Generator[None, None, None]:
    """Render and measure."""
    with open_sensor(profile, bundle=bundle, sim=True) as sensor:
        for _ in sensor.stream():
            yield


if __name__ == "__main__":
    main()
