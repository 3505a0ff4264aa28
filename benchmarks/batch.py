"""Throughput of two processes relative to one: ``python benchmarks/batch.py [--rounds 2]``.

Measures the same recordings of a virtual unit by ``tactile run``, with one worker and with two, and
by a local dask cluster of one worker and of two. The cases alternate, so that other load on the
machine affects them equally. Prints elapsed time and processor time, both with the start of every
process, and the load of the machine, on which the ratio of elapsed times depends: it means little
if others use the cores. The ratio of processor times does not depend on it; the second of two
processes costs nothing but its core if that ratio is 1.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import NamedTuple

import cv2

from tactile_core.calibration.virtual_unit import virtual_unit
from tactile_core.profiles.loader import load_profile

PROFILE = "hex_fingertip"
SIZE_PX = (320, 240)
ADDRESS = "tcp://127.0.0.1:8796"
ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


class Cost(NamedTuple):
    """Of one run: elapsed time and processor time, s, and the machine's load before it."""

    elapsed_s: float
    processor_s: float
    load: float


def main() -> None:
    """Print a table of both ways."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=4)
    parser.add_argument("--frames", type=int, default=1200, help="of each recording")
    parser.add_argument("--rounds", type=int, default=2)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place, given.recordings, given.frames)
        compared(
            "processes", [[in_processes(place, n) for n in (1, 2)] for _ in range(given.rounds)]
        )
        if find_spec("distributed") is None:
            print("dask is not installed; pip install plugins/tactile-cluster")
            return
        compared(
            "dask workers", [[on_cluster(place, n) for n in (1, 2)] for _ in range(given.rounds)]
        )


def prepare(place: Path, recordings: int, frames: int) -> None:
    """Write a profile, its bundle, and recordings of a ball that shears the gel."""
    unit = virtual_unit(load_profile(PROFILE), size_px=SIZE_PX)
    unit.bundle.save(place / "bundle")
    width, height = SIZE_PX
    (place / "profile.yaml").write_text(
        f"schema: 1\nname: {unit.profile.name}\nextends: {PROFILE}\nimage: {{width_px: {width}, "
        f"height_px: {height}, mm_per_px: {unit.profile.image.mm_per_px}}}\n"
    )
    for recording in range(recordings):
        folder = place / "recordings" / f"shear_{recording}"
        folder.mkdir(parents=True)
        for number in range(frames):
            pixels = unit.stroke[number % len(unit.stroke)].pixels
            cv2.imwrite(str(folder / f"{number:06d}.png"), pixels[..., ::-1])


def in_processes(place: Path, workers: int) -> Cost:
    """Measure by so many processes."""
    before_s, load, start = children_s(), os.getloadavg()[0], time.perf_counter()
    measure(place, "--workers", str(workers))
    return Cost(time.perf_counter() - start, children_s() - before_s, load)


def on_cluster(place: Path, workers: int) -> Cost:
    """Measure by a cluster of so many workers, which runs already."""
    import psutil

    with cluster(workers) as worker:
        processes = psutil.Process(worker).children(recursive=True)
        before_s, load, start = total_s(processes), os.getloadavg()[0], time.perf_counter()
        measure(place, "--cluster", ADDRESS)
        return Cost(time.perf_counter() - start, total_s(processes) - before_s, load)


def measure(place: Path, *options: str) -> None:
    """Run the command."""
    out = place / "out"
    shutil.rmtree(out, ignore_errors=True)
    words = ["run", place / "profile.yaml", "--input", place / "recordings"]
    words += ["--bundle", place / "bundle", "--out", out, "--save", "tmd", *options]
    command = [sys.executable, "-m", "tactile_core.cli", *map(str, words)]
    subprocess.run(command, check=True, env=ENVIRONMENT, stdout=subprocess.DEVNULL)


@contextmanager
def cluster(workers: int) -> Iterator[int]:
    """Run a scheduler and workers of one thread each; yields the number of their process."""
    run = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    options = ["--host", ADDRESS, "--no-dashboard"]
    scheduler = subprocess.Popen([*run, *options], stderr=subprocess.DEVNULL)
    run[-1] = "distributed.cli.dask_worker"
    options = [ADDRESS, "--nworkers", str(workers), "--nthreads", "1", "--no-dashboard"]
    worker = subprocess.Popen([*run, *options], env=ENVIRONMENT, stderr=subprocess.DEVNULL)
    try:
        from distributed import Client

        with Client(ADDRESS, set_as_default=False) as client:
            client.wait_for_workers(workers)
        yield worker.pid
    finally:
        for process in (worker, scheduler):
            process.terminate()
            process.wait()


def children_s() -> float:
    """Processor time of all processes that this one has waited for, s."""
    times = os.times()
    return times.children_user + times.children_system


def total_s(processes: list) -> float:
    """Processor time of processes that run, s."""
    return sum(process.cpu_times().user + process.cpu_times().system for process in processes)


def compared(title: str, rounds: list[list[Cost]]) -> None:
    """Print the rounds, and the medians of the ratios."""
    print(f"{title:14}{'elapsed s':>12}{'processor s':>13}{'load before':>13}")
    for costs in rounds:
        for number, cost in enumerate(costs, 1):
            elapsed_s, processor_s, load = cost
            print(f"{number:<14}{elapsed_s:12.1f}{processor_s:13.1f}{load:13.1f}")
    elapsed = median(one.elapsed_s / two.elapsed_s for one, two in rounds)
    processor = median(one.processor_s / two.processor_s for one, two in rounds)
    print(f"two relative to one: {elapsed:.2f} in elapsed time, {processor:.2f} in processor time")
    print(f"on {os.cpu_count()} cores", flush=True)


if __name__ == "__main__":
    main()
