"""Cost of each stage of a frame's way on this machine, on virtual units of the profiles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from tactile_core.benching.machine import available_cores, machine
from tactile_core.benching.processes import WARM_UP_FRAMES, streamed
from tactile_core.benching.stream import Stream
from tactile_core.benching.unit import VirtualUnit, virtual_unit
from tactile_core.errors import TactileError
from tactile_core.fresh_process import one_thread
from tactile_core.profiles.model import Profile
from tactile_core.progress import Progress, Silent

SECONDS = 6.0
"""How long the stages of all units are measured together."""

_FEWEST_ROUNDS = 10


@dataclass(frozen=True)
class Cost:
    """What one stage costs.

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
        """How many frames a second one core would take through this stage alone."""
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
    """The costs of one profile at one size.

    Attributes
    ----------
    profile, model : str
        The profile's name, and the calibration that was fitted.
    size_px : (width, height)
    stages : tuple of Cost
        In the order of a frame's way; the last is the whole of it, measured by itself.
    rounds : int
        How often each was measured.
    peak_memory_mib : float or None
        Largest resident memory of a process that only streams, Python and libraries included.
    two_process_ratio : float or None
        Frames a second of two such processes at once over those of one; None on one core.
    uses_numba : bool
        Whether the ``fast`` extra took part.
    """

    profile: str
    model: str
    size_px: tuple[int, int]
    stages: tuple[Cost, ...]
    rounds: int
    peak_memory_mib: float | None
    two_process_ratio: float | None
    uses_numba: bool

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
            "fast": self.uses_numba,
        }


@dataclass(frozen=True)
class Benches:
    """What was measured, and on what.

    Attributes
    ----------
    machine : dict
        See :func:`~tactile_core.benching.machine.machine`.
    benches : tuple of Bench
    left_out : tuple of str
        The profiles that could not be built, each with the reason.
    """

    machine: dict[str, Any]
    benches: tuple[Bench, ...]
    left_out: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """What ``tactile bench --json`` prints."""
        fast = {
            "installed": self.machine["versions"]["numba"] is not None,
            "used": any(bench.uses_numba for bench in self.benches),
        }
        return {
            "machine": self.machine,
            "fast": fast,
            "benches": [bench.summary() for bench in self.benches],
            "left_out": list(self.left_out),
        }


def bench(
    profiles: Sequence[Profile],
    *,
    sizes_px: Sequence[tuple[int, int]] = (),
    seconds: float = SECONDS,
    progress: Progress | None = None,
) -> Benches:
    """Measure what each stage costs, one thread on one core.

    Every profile gets a virtual unit, calibrated on rendered presses. All units take turns, a frame
    at a time, so that a machine that slows down slows all alike.

    Parameters
    ----------
    profiles : sequence of Profile
    sizes_px : sequence of (width, height), optional
        Image sizes; by default each profile's own.
    seconds : float
        How long to measure the stages of all together; each is measured ten times at least.
    progress : Progress, optional

    Raises
    ------
    TactileError
        Not one of the profiles can be built; with more than one, those that cannot are left out.
    """
    progress = progress or Silent()
    asked = [(profile, size) for profile in profiles for size in (*sizes_px,) or (None,)]
    units: list[VirtualUnit] = []
    left_out = []
    with one_thread():
        for profile, size_px in asked:
            progress.stage(f"calibrating {profile.name}", 0.4 / len(asked))
            try:
                units.append(virtual_unit(profile, size_px=size_px))
            except TactileError as error:
                if len(profiles) == 1:
                    raise
                left_out.append(f"{profile.name}: {error}")
        progress.stage("measuring stages", 0.25)
        all_costs, rounds = _costs(units, seconds, progress)
    benches = []
    for unit, costs in zip(units, all_costs, strict=True):
        progress.stage(f"streaming {unit.profile.name}", 0.35 / len(units))
        alone, ratio = streamed(unit, two=available_cores() > 1)
        benches.append(
            Bench(
                profile=unit.profile.name,
                model=unit.bundle.manifest.model,
                size_px=unit.bundle.manifest.image_size_px,
                stages=costs,
                rounds=rounds,
                peak_memory_mib=alone.peak_memory_mib,
                two_process_ratio=ratio,
                uses_numba=alone.uses_numba,
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
            stream.staged()
    times: list[dict[str, list[float]]] = [{} for _ in streams]
    start, rounds = perf_counter(), 0
    while rounds < _FEWEST_ROUNDS or perf_counter() - start < seconds:
        for stream, collected in zip(streams, times, strict=True):
            for name, time_ms in (stream.staged() | stream.whole()).items():
                collected.setdefault(name, []).append(time_ms)
        rounds += 1
        done = min(rounds / _FEWEST_ROUNDS, (perf_counter() - start) / seconds)
        progress.fraction(min(done, 1.0))
    costs = [
        tuple(
            Cost(name, float(np.median(values)), float(np.percentile(values, 90)))
            for name, values in collected.items()
        )
        for collected in times
    ]
    return costs, rounds
