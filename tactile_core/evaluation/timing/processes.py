"""Whole streams in processes of their own: their memory, and what a second one costs the first."""

from __future__ import annotations

import sys
from collections.abc import Generator
from dataclasses import dataclass
from statistics import median
from time import perf_counter

from tactile_core.evaluation.fresh_process import FreshProcess, one_thread, peak_memory_mib
from tactile_core.evaluation.timing.stream import Stream
from tactile_core.evaluation.timing.unit import VirtualUnit

WARM_UP_FRAMES = 4
_ROUNDS, _ROUND_S = 3, 0.15


@dataclass(frozen=True)
class Alone:
    """What a process that only streams a unit's frames tells of itself.

    Attributes
    ----------
    peak_memory_mib : float or None
        Largest resident memory, Python and libraries included; None where the system does not tell.
    uses_numba : bool
        Whether the ``fast`` extra has been used.
    """

    peak_memory_mib: float | None
    uses_numba: bool


def streamed(unit: VirtualUnit, *, two: bool) -> tuple[Alone, float | None]:
    """Stream a unit in one process, and in two at once.

    One and two take turns, so that a busy machine slows both alike.

    Returns
    -------
    alone : Alone
    ratio : float or None
        Frames per second of two processes together over those of one; None unless ``two``.
    """
    with FreshProcess(_stream, unit) as first:
        if not two:
            return first.receive(), None
        with FreshProcess(_stream, unit) as second:
            alone: Alone = first.receive()
            second.receive()
            ratios = []
            for _ in range(_ROUNDS):
                rates = [_rate(first), _rate(first, second)]
                ratios.append(rates[1] / rates[0])
    return alone, median(ratios)


def _rate(*processes: FreshProcess) -> float:
    for process in processes:
        process.send(_ROUND_S)
    return float(sum(process.receive() for process in processes))


def _stream(unit: VirtualUnit) -> Generator[Alone | float, float, None]:
    with one_thread():
        stream = Stream(unit)
        for _ in range(WARM_UP_FRAMES):
            stream.whole()
        duration_s = yield Alone(peak_memory_mib(), "numba" in sys.modules)
        while True:
            count, start = 0, perf_counter()
            while (elapsed_s := perf_counter() - start) < duration_s:
                stream.whole()
                count += 1
            duration_s = yield count / elapsed_s
