"""Time and memory of each processing stage on this machine, with virtual sensors."""

from __future__ import annotations

import platform
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from tactile_core.calibration.virtual_unit import VirtualUnit, virtual_unit
from tactile_core.errors import TactileError
from tactile_core.evaluation.own_resources import one_thread, peak_memory_mib
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.pipeline.workers import WorkerProcess, available_cores
from tactile_core.plugins.entry_points import library_versions
from tactile_core.profiles.model import Profile
from tactile_sim.timing.unit import Stream


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
    """

    profile: str
    model: str
    size_px: tuple[int, int]
    stages: tuple[Cost, ...]
    rounds: int
    peak_memory_mib: float | None

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        peak = self.peak_memory_mib
        return {
            "profile": self.profile,
            "model": self.model,
            "size_px": list(self.size_px),
            "stages": [cost.summary() for cost in self.stages],
            "rounds": self.rounds,
            "peak_memory_mib": None if peak is None else round(peak, 1),
        }


@dataclass(frozen=True)
class Benches:
    """Benchmarks of several profiles on one machine.

    Attributes
    ----------
    machine : dict
        See :func:`~tactile_sim.timing.machine`.
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


def machine() -> dict[str, Any]:
    """Name of the processor, available cores, and versions."""
    return {
        "cpu": _cpu_name(),
        "cores": available_cores(),
        "system": platform.platform(terse=True),
        "versions": library_versions(),
    }


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith(("model name", "Model")):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


# Frames before timing starts. Chosen by hand; the first one compiles and prepares tables.
WARM_UP_FRAMES = 4


def peak_of_stream_mib(unit: VirtualUnit) -> float | None:
    """Return the peak resident memory of a process that only streams a unit, MiB.

    Python and libraries are included; None if the system does not report it.
    """
    unit = replace(unit, frames=())  # a stream holds no images but its own
    with WorkerProcess(_stream, unit) as process:
        peak_mib: float | None = process.receive()
    return peak_mib


def _stream(unit: VirtualUnit) -> Generator[float | None, None, None]:
    stream = Stream(unit)
    for _ in range(WARM_UP_FRAMES):
        stream.whole()
    yield peak_memory_mib()


SECONDS = 6.0  # Default time for measuring the stages of all units together, s. Chosen by hand.

_MIN_ROUNDS = 10  # Fewest rounds per stage. Chosen by hand; a 90th percentile needs at least ten.


def bench(
    profiles: Sequence[Profile],
    *,
    sizes_px: Sequence[tuple[int, int]] = (),
    calibration: str | None = None,
    seconds: float = 6.0,
    progress: Progress | None = None,
) -> Benches:
    """Measure the time of each stage with one thread on one core.

    Every profile gets a virtual unit, calibrated on rendered presses. The units alternate frame by
    frame, so that other load on the machine affects all equally.

    Parameters
    ----------
    profiles : sequence of Profile
    sizes_px : sequence of (width, height), optional
        Image sizes. Default: each profile's own.
    calibration : str, optional
        Calibrator to fit, ``plugin.name``. Default: each profile's own.
    seconds : float
        Time for measuring the stages of all units together; each stage is measured at least ten
        times.
    progress : Progress, optional

    Raises
    ------
    TactileError
        The only profile cannot be built. Of several profiles, those that fail are left out.
    """
    progress = progress or Silent()
    builds = [(profile, size) for profile in profiles for size in (*sizes_px,) or (None,)]
    units: list[VirtualUnit] = []
    left_out = []
    with one_thread():
        for profile, size_px in builds:
            progress.stage(f"calibrating {profile.name}", 0.4 / len(builds))
            try:
                units.append(virtual_unit(profile, size_px=size_px, model=calibration))
            except TactileError as error:
                if len(profiles) == 1:
                    raise
                left_out.append(f"{profile.name}: {error}")
        progress.stage("measuring stages", 0.25)
        all_costs, rounds = _costs(units, seconds, progress)
    benches = []
    for unit, costs in zip(units, all_costs, strict=True):
        progress.stage(f"streaming {unit.profile.name}", 0.35 / len(units))
        benches.append(
            Bench(
                profile=unit.profile.name,
                model=unit.bundle.manifest.model,
                size_px=unit.bundle.manifest.image_size_px,
                stages=costs,
                rounds=rounds,
                peak_memory_mib=peak_of_stream_mib(unit),
            )
        )
    return Benches(machine(), tuple(benches), tuple(left_out))


def _costs(
    units: Sequence[VirtualUnit], seconds: float, progress: Progress
) -> tuple[list[tuple[Cost, ...]], int]:
    streams = [Stream(unit) for unit in units]
    for stream in streams:
        for _ in range(WARM_UP_FRAMES):
            stream.whole()
            stream.time_stages()
    times: list[dict[str, list[float]]] = [{} for _ in streams]
    start, rounds = perf_counter(), 0
    while rounds < _MIN_ROUNDS or perf_counter() - start < seconds:
        for stream, collected in zip(streams, times, strict=True):
            for name, time_ms in (stream.time_stages() | stream.whole()).items():
                collected.setdefault(name, []).append(time_ms)
        rounds += 1
        done = min(rounds / _MIN_ROUNDS, (perf_counter() - start) / seconds)
        progress.fraction(min(done, 1.0))
    costs = [
        tuple(
            Cost(name, float(np.median(values)), float(np.percentile(values, 90)))
            for name, values in collected.items()
        )
        for collected in times
    ]
    return costs, rounds
