"""Speed-up by the extra ``fast``: ``python benchmarks/bench_fast.py [PROFILE …] [--size 640x480]``.

Streams the same frames with and without compiled kernels, in two processes that alternate. Prints
the median processor time of a whole frame, which other load on the machine barely affects, and the
median ratio.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Generator

import numpy as np

from tactile_core.evaluation.own_resources import one_thread
from tactile_core.evaluation.timing.stream import Stream
from tactile_core.evaluation.timing.unit import VirtualUnit, virtual_unit
from tactile_core.pipeline.worker_process import WorkerProcess
from tactile_core.profiles.loader import load_profile

PROFILES = ("hex_fingertip", "hex_fingertip_unmarked", "desktop_six_led")
TURNS, FRAMES, WARM_UP = 12, 10, 4
"""Alternations, frames per turn, and frames before timing starts (counts)."""


def main() -> None:
    """Print a row per profile and size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("profiles", nargs="*", default=PROFILES)
    parser.add_argument("--size", action="append", help="default: 640x480")
    given = parser.parse_args()
    print(f"{'ms of a whole frame':24}{'size':>12}{'fast':>8}{'without':>9}{'ratio':>7}")
    for name in given.profiles:
        for size in given.size or ("640x480",):
            width, height = (int(side) for side in size.split("x"))
            unit = virtual_unit(load_profile(name), size_px=(width, height))
            fast, plain = alternated(unit)
            ratio = np.median(np.median(fast, axis=1) / np.median(plain, axis=1))
            print(
                f"{name:24}{size:>12}{np.median(fast):8.2f}{np.median(plain):9.2f}{ratio:7.2f}",
                flush=True,
            )


def alternated(unit: VirtualUnit) -> tuple[list[list[float]], list[list[float]]]:
    """Processor time in ms of each frame of each turn, with and without the kernels."""
    fast, plain = [], []
    with WorkerProcess(streamed, unit, True) as one, WorkerProcess(streamed, unit, False) as other:
        one.receive()
        other.receive()
        for process, times in [(one, fast), (other, plain)] * TURNS:
            process.send(FRAMES)
            times.append(process.receive())
    return fast, plain


def streamed(unit: VirtualUnit, fast: bool) -> Generator[list[float], int, None]:
    """Process the requested number of frames and yield their times in ms."""
    os.environ["TACTILE_FAST"] = "1" if fast else "0"
    with one_thread():
        stream = Stream(unit)
        count = yield [frame_ms(stream) for _ in range(WARM_UP)]
        while True:
            count = yield [frame_ms(stream) for _ in range(count)]


def frame_ms(stream: Stream) -> float:
    """Processor time of the next frame."""
    start = time.process_time()
    stream.whole()
    return 1e3 * (time.process_time() - start)


if __name__ == "__main__":
    # imported by name, so that a separate process can unpickle its functions
    from bench_fast import main

    main()
