"""How the cost of a frame grows: ``OMP_NUM_THREADS=1 python benchmarks/cost.py [WHAT …]``.

Prints a table for each of: pixels, markers, sensors and processes. The times of the first two are
the processor time of a whole frame of ``hex_fingertip``, relative to 640 × 480 with the profile's
markers; the other two count frames a second by the clock, so they need an idle machine.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Generator
from contextlib import ExitStack
from functools import partial

import numpy as np

from tactile_core.calibration.virtual_unit import VirtualUnit, virtual_unit
from tactile_core.evaluation.own_resources import one_thread
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.workers import WorkerProcess
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.timing.unit import Stream

WIDTHS = (160, 320, 640, 960, 1280, 1920)
PITCHES_MM = (2.2, 1.6, 1.1, 0.85)
COUNTS = (1, 2, 3, 4)
FRAMES, TURNS, SECONDS = 24, 5, 4.0
"""Frames per turn, turns, and duration of a count by the clock."""


def fingertip(pitch_mm: float | None = None) -> Profile:
    """The fingertip with another distance between its markers."""
    profile = load_profile("hex_fingertip")
    if pitch_mm is None:
        return profile
    markers = profile.gel.markers.model_copy(update={"pitch_mm": pitch_mm})
    return profile.model_copy(update={"gel": profile.gel.model_copy(update={"markers": markers})})


def frame_ms(unit: VirtualUnit) -> float:
    """Median processor time of a whole frame."""
    with one_thread():
        stream, taken = Stream(unit), []
        for number in range(FRAMES * TURNS):
            start = time.process_time()
            stream.whole()
            if number >= FRAMES:
                taken.append(1e3 * (time.process_time() - start))
    return float(np.median(taken))


def pixels() -> None:
    """Print the cost against the size of the image."""
    base = frame_ms(virtual_unit(fingertip()))
    print("| image | megapixels | time |\n| --- | --- | --- |")
    for width in WIDTHS:
        height = 1080 if width == 1920 else width * 3 // 4
        unit = virtual_unit(fingertip(), size_px=(width, height))
        share = frame_ms(unit) / base
        print(f"| {width} × {height} | {width * height / 1e6:.2f} | {share:.2f} |", flush=True)


def markers() -> None:
    """Print the cost against the number of markers."""
    base = frame_ms(virtual_unit(fingertip()))
    print("| markers | time |\n| --- | --- |")
    for pitch_mm in PITCHES_MM:
        unit = virtual_unit(fingertip(pitch_mm))
        found = Pipeline(unit.profile, unit.bundle).reference
        assert found is not None
        assert found.detections is not None
        count = len(found.detections.centres_px)
        print(f"| {count} | {frame_ms(unit) / base:.2f} |", flush=True)


def sensors() -> None:
    """Print the frames a second of several sensors in one process, one after another."""
    unit = virtual_unit(fingertip())
    print("| sensors in one process | frames a second of each |\n| --- | --- |")
    for count in COUNTS:
        with one_thread():
            streams = [Stream(unit) for _ in range(count)]
            rate = per_second(partial(turn, streams))
        print(f"| {count} | {rate:.0f} |", flush=True)


def turn(streams: list[Stream]) -> None:
    """Measure a frame of each sensor."""
    for stream in streams:
        stream.whole()


def processes() -> None:
    """Print the frames a second of processes that measure one sensor each."""
    unit = virtual_unit(fingertip())
    print(f"| processes on {os.cpu_count()} cores | frames a second of each |\n| --- | --- |")
    for count in COUNTS:
        with ExitStack() as stack:
            every = [stack.enter_context(WorkerProcess(counted, unit)) for _ in range(count)]
            for one in every:
                one.receive()
            for one in every:
                one.send(None)
            print(f"| {count} | {np.mean([one.receive() for one in every]):.0f} |", flush=True)


def counted(unit: VirtualUnit) -> Generator[float, None, None]:
    """Count the frames a second of one sensor, when asked to."""
    with one_thread():
        stream = Stream(unit)
        for _ in range(FRAMES):
            stream.whole()
        yield 0.0
        while True:
            yield per_second(stream.whole)


def per_second(turn: Callable[[], object]) -> float:
    """Turns a second by the clock."""
    for _ in range(FRAMES):
        turn()
    count, start = 0, time.perf_counter()
    while time.perf_counter() - start < SECONDS:
        turn()
        count += 1
    return count / (time.perf_counter() - start)


def main() -> None:
    """Print the chosen tables."""
    tables = {"pixels": pixels, "markers": markers, "sensors": sensors, "processes": processes}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="*", choices=[*tables, []], default=[])
    for name in parser.parse_args().what or tables:
        tables[name]()
        print()


if __name__ == "__main__":
    # imported by name, so that a separate process can unpickle its functions
    from cost import main

    main()
