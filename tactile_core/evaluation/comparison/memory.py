"""Peak memory of a process that only measures a recording."""

from __future__ import annotations

from collections.abc import Generator
from itertools import islice
from typing import Any

from tactile_core.evaluation.comparison.variants import ComparedInput, Variant
from tactile_core.evaluation.own_resources import one_thread, peak_memory_mib
from tactile_core.pipeline.workers import WorkerProcess

# Frames that the process measures. Chosen by hand; memory no longer grows after the first few.
FRAMES = 20


def peak_of_stream_mib(
    variant: Variant, recording: ComparedInput
) -> tuple[float | None, tuple[str, ...]]:
    """Measure the first frames in a separate process.

    Returns
    -------
    peak_mib : float or None
        Its peak resident memory, including Python and libraries.
    notes : tuple of str
        Notes of the sensor on opening.
    """
    with WorkerProcess(_stream, variant, recording) as process:
        peak_mib, notes = process.receive()
    return peak_mib, notes


def _stream(variant: Variant, recording: ComparedInput) -> Generator[Any, None, None]:
    with one_thread(), variant.open(recording) as sensor:
        for _ in islice(sensor.stream(), FRAMES):
            pass
        yield peak_memory_mib(), sensor.notes
