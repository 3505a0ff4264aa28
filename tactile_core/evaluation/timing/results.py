"""The results of a timing, and the processes in which it is taken."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Generator
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from tactile_core.evaluation.own_resources import one_thread, peak_memory_mib
from tactile_core.evaluation.timing.unit import Stream, VirtualUnit
from tactile_core.pipeline.workers import WorkerProcess


@dataclass(frozen=True)
class Cost:
    """Time of one stage.

    Attributes
    ----------
    stage : str
    median_ms, p90_ms : float
    """

    stage: str
    median_ms: float
    p90_ms: float

    @property
    def per_second(self) -> float:
        """Frames per second of this stage alone on one core."""
        return 1e3 / self.median_ms

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "stage": self.stage,
            "median_ms": round(self.median_ms, 4),
            "p90_ms": round(self.p90_ms, 4),
            "fps": round(self.per_second, 1),
        }


@dataclass(frozen=True)
class Bench:
    """Time and memory of one profile at one image size.

    Attributes
    ----------
    profile, model : str
        Names of the profile and of the fitted calibrator.
    size_px : (width, height)
    stages : tuple of Cost
        In processing order; the last one is the whole frame, measured separately.
    rounds : int
        Number of measurements of each stage.
    peak_memory_mib : float or None
        Peak resident memory of a process that only streams, including Python and libraries.
    two_process_ratio : float or None
        Throughput of two such processes at once relative to one; None on one core.
    """

    profile: str
    model: str
    size_px: tuple[int, int]
    stages: tuple[Cost, ...]
    rounds: int
    peak_memory_mib: float | None
    two_process_ratio: float | None

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        ratio, peak = self.two_process_ratio, self.peak_memory_mib
        return {
            "profile": self.profile,
            "model": self.model,
            "size_px": list(self.size_px),
            "stages": [cost.summary() for cost in self.stages],
            "rounds": self.rounds,
            "peak_memory_mib": None if peak is None else round(peak, 1),
            "two_process_ratio": None if ratio is None else round(ratio, 3),
        }


@dataclass(frozen=True)
class Benches:
    """Benchmarks of several profiles on one machine.

    Attributes
    ----------
    machine : dict
        See :func:`~tactile_core.evaluation.timing.results.machine`.
    benches : tuple of Bench
    left_out : tuple of str
        Profiles that could not be built, each with the reason.
    """

    machine: dict[str, Any]
    benches: tuple[Bench, ...]
    left_out: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """The output of ``tactile bench --json``."""
        return {
            "machine": self.machine,
            "benches": [bench.summary() for bench in self.benches],
            "left_out": list(self.left_out),
        }


_PACKAGES = ("numpy", "scipy", "opencv-contrib-python-headless", "scikit-image")


def machine() -> dict[str, Any]:
    """Name of the processor, available cores, and versions (None: not installed)."""
    from tactile_core import __version__

    return {
        "cpu": _cpu_name(),
        "cores": available_cores(),
        "system": platform.platform(terse=True),
        "versions": {
            "tactile-core": __version__,
            "python": platform.python_version(),
            **{name: _version(name) for name in _PACKAGES},
        },
    }


def available_cores() -> int:
    """Number of cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith(("model name", "Model")):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


# Frames before timing starts. Chosen by hand; the first one compiles and prepares tables.
WARM_UP_FRAMES = 4


class STREAMING:
    """Measurement of throughput with one and with two processes."""

    rounds = 3  # [count] Alternations between one and two processes; the result is their median
    round_s = 0.15  # [s] Duration of one measurement


def stream_unit(unit: VirtualUnit, *, two: bool) -> tuple[float | None, float | None]:
    """Stream a unit in one process, and in two at once.

    Both cases alternate, so that other load on the machine affects them equally.

    Returns
    -------
    peak_memory_mib : float or None
        Peak resident memory of one process, including Python and libraries; None if the system
        does not report it.
    ratio : float or None
        Total throughput of two processes relative to one; None unless ``two``.
    """
    unit = replace(unit, frames=())  # a stream holds no images but its own
    with WorkerProcess(_stream, unit) as first:
        if not two:
            return first.receive(), None
        with WorkerProcess(_stream, unit) as second:
            peak_mib: float | None = first.receive()
            second.receive()
            ratios = []
            for _ in range(STREAMING.rounds):
                rates = [_rate(first), _rate(first, second)]
                ratios.append(rates[1] / rates[0])
    return peak_mib, median(ratios)


def _rate(*processes: WorkerProcess) -> float:
    for process in processes:
        process.send(STREAMING.round_s)
    return float(sum(process.receive() for process in processes))


def _stream(unit: VirtualUnit) -> Generator[float | None, float, None]:
    with one_thread():
        stream = Stream(unit)
        for _ in range(WARM_UP_FRAMES):
            stream.whole()
        duration_s = yield peak_memory_mib()
        while True:
            count, start = 0, perf_counter()
            while (elapsed_s := perf_counter() - start) < duration_s:
                stream.whole()
                count += 1
            duration_s = yield count / elapsed_s
