"""Time and memory of each processing stage on this machine, with virtual sensors."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from tactile_core.errors import TactileError
from tactile_core.evaluation.own_resources import one_thread
from tactile_core.evaluation.timing.results import (
    WARM_UP_FRAMES,
    machine,
    peak_of_stream_mib,
)
from tactile_core.evaluation.timing.results import Bench as Bench
from tactile_core.evaluation.timing.results import Benches as Benches
from tactile_core.evaluation.timing.results import Cost as Cost
from tactile_core.evaluation.timing.unit import Stream, VirtualUnit, virtual_unit
from tactile_core.interfaces.calibrator import Progress, Silent
from tactile_core.profiles.model import Profile

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
