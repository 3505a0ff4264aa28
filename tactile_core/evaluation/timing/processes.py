"""Streams in separate processes: their memory, and the throughput of two at once."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from statistics import median
from time import perf_counter

from tactile_core.evaluation.own_resources import one_thread, peak_memory_mib
from tactile_core.evaluation.timing.stream import Stream
from tactile_core.evaluation.timing.unit import VirtualUnit
from tactile_core.pipeline.workers import WorkerProcess

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
