"""Time per frame of several variants, interleaved so that other load affects all equally."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.quantities import Frame

# Fewest frames to time; shorter recordings are repeated, for timing only. Chosen by hand.
LEAST_FRAMES = 20


def interleaved(streams: Sequence[Iterator[Reading]]) -> Iterator[list[Reading]]:
    """Yield the readings of each frame; the streams rotate so that each is first equally often."""
    number = 0
    while True:
        readings: dict[int, Reading] = {}
        for turn in range(len(streams)):
            index = (number + turn) % len(streams)
            reading = next(streams[index], None)
            if reading is None:
                return
            readings[index] = reading
        yield [readings[index] for index in range(len(streams))]
        number += 1


class Clock:
    """Collects the latencies of readings.

    The first reading is a warm-up (it prepares tables) and is not counted.

    Parameters
    ----------
    pipelines : sequence of Pipeline
        Pipelines of the readings.
    """

    def __init__(self, pipelines: Sequence[Pipeline]) -> None:
        self._pipelines = pipelines
        self._latency_ms: list[list[float]] = [[] for _ in pipelines]
        self._frames: list[Frame] = []
        self._warm = False

    def latency_ms(self, index: int) -> tuple[float, ...]:
        """Latencies of one pipeline."""
        return tuple(self._latency_ms[index])

    def note(self, readings: Sequence[Reading]) -> None:
        """Count the readings of a frame, one of each pipeline."""
        if len(self._frames) < LEAST_FRAMES:
            # marker detection is part of the time, so a repetition has to detect them again
            self._frames.append(replace(readings[0].frame, marker_mask=None))
        if self._warm:
            for times, reading in zip(self._latency_ms, readings, strict=True):
                times.append(reading.latency_ms)
        self._warm = True

    def fill(self) -> None:
        """Repeat the first frames until enough are timed."""
        while len(self._latency_ms[0]) < LEAST_FRAMES:
            for pipeline in self._pipelines:
                pipeline.reset()
            again = [map(pipeline.process, self._frames) for pipeline in self._pipelines]
            for readings in interleaved(again):
                self.note(readings)
