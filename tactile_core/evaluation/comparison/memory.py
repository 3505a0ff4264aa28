"""Memory that it takes to measure a recording, and nothing else."""

from __future__ import annotations

from collections.abc import Generator
from itertools import islice
from typing import Any

from tactile_core.evaluation.comparison.variants import ComparedInput, Variant
from tactile_core.evaluation.fresh_process import FreshProcess, one_thread, peak_memory_mib

FRAMES = 20


def peak_of_stream_mib(
    variant: Variant, recording: ComparedInput
) -> tuple[float | None, tuple[str, ...]]:
    """Measure the first frames in a process of its own.

    Returns
    -------
    peak_mib : float or None
        Its largest resident memory, Python and libraries included.
    notes : tuple of str
        What the sensor says when it is opened.
    """
    with FreshProcess(_stream, variant, recording) as process:
        peak_mib, notes = process.receive()
    return peak_mib, notes


def _stream(variant: Variant, recording: ComparedInput) -> Generator[Any, None, None]:
    with one_thread(), variant.open(recording) as sensor:
        for _ in islice(sensor.stream(), FRAMES):
            pass
        yield peak_memory_mib(), sensor.notes
