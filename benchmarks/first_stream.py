"""Frames of the first stream after the extra ``fast`` is installed.

``python benchmarks/first_stream.py`` streams rendered frames at the pace of a camera, with an empty
folder of compiled code, until a process in the background has compiled the kernels, and some
seconds longer; then a second stream, which loads them. Prints the time until each pipeline is made
and of its first frame, and the median and the worst of the others: elapsed, and of the processor.
The rows "afterwards" show what other load on the machine does. With ``--waiting`` the stream itself
compiles.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Generator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactile_core.evaluation.own_resources import one_thread
from tactile_core.evaluation.timing.unit import VirtualUnit, virtual_unit
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.worker_process import WorkerProcess
from tactile_core.profiles.loader import load_profile

PERIOD_S = 1 / 20
"""Pace of the camera."""
AFTERWARDS_S, LONGEST_S = 10.0, 300.0
"""Length of a stream once the kernels are compiled, and until then."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("profile", nargs="?", default="hex_fingertip")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--waiting", action="store_true")
    given = parser.parse_args()
    width, height = (int(side) for side in given.size.split("x"))
    unit = virtual_unit(load_profile(given.profile), size_px=(width, height))
    print(f"{'ms, elapsed (processor)':24}{'made':>14}{'first':>14}{'median':>14}{'worst':>14}")
    with TemporaryDirectory() as cache:
        os.environ["NUMBA_CACHE_DIR"] = cache
        os.environ.pop("TACTILE_FAST", None)
        if given.waiting:
            os.environ["TACTILE_FAST"] = "1"
        for name in ("first stream", "second stream"):
            with WorkerProcess(streamed, unit, Path(cache)) as process:
                compiled, made, parts = process.receive()
            first, *others = (time for part in parts for time in part)
            columns = [made, first, np.median(others, axis=0), np.max(others, axis=0)]
            print(row(f"{name}, {'kernels' if compiled else 'numpy'}", columns), flush=True)
            if parts[1]:
                print(row("   afterwards", [np.median(parts[1], axis=0), np.max(parts[1], axis=0)]))


def row(name: str, columns: list) -> str:
    cells = [f"{elapsed:.0f} ({processor:.0f})" for elapsed, processor in columns]
    return f"{name:24}" + "".join(f"{cell:>14}" for cell in [""] * (4 - len(cells)) + cells)


def streamed(unit: VirtualUnit, cache: Path) -> Generator[tuple, None, None]:
    """Stream; yield whether by kernels, and the times in ms while they are compiled and after."""
    with one_thread():
        start = time.perf_counter(), time.process_time()
        pipeline = Pipeline(unit.profile, unit.bundle)
        pipeline.warm()  # as a live sensor does before its camera is opened
        made, parts = since(start), ([], [])
        compiling = not any(cache.glob("tactile-*.txt"))
        end = time.perf_counter() + (LONGEST_S if compiling else AFTERWARDS_S)
        while time.perf_counter() < end:
            start = time.perf_counter(), time.process_time()
            frame = unit.stroke[sum(map(len, parts)) % len(unit.stroke)]
            pipeline.process(frame)
            parts[not compiling].append(since(start))
            time.sleep(max(0.0, PERIOD_S - 1e-3 * parts[not compiling][-1][0]))
            if compiling and (pipeline.compiled or any(cache.glob("tactile-*.txt"))):
                compiling, end = False, time.perf_counter() + AFTERWARDS_S
        yield pipeline.compiled, made, parts


def since(start: tuple[float, float]) -> tuple[float, float]:
    """Elapsed and processor time, ms."""
    return 1e3 * (time.perf_counter() - start[0]), 1e3 * (time.process_time() - start[1])


if __name__ == "__main__":
    # imported by name, so that a separate process can unpickle its functions
    from first_stream import main

    main()
