"""Measures frames in parallel processes and keeps their order."""

from __future__ import annotations

import pickle
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import Future
from functools import partial
from itertools import islice
from typing import Protocol

from tactile_core.errors import InputError
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.workers import WorkerProcess, Workers
from tactile_core.quantities import Frame

_WAITING_EACH = 2  # Frames queued per worker: enough that none is idle, few enough to save memory


class Processor(Protocol):
    """The part of a pipeline that a worker uses."""

    def warm(self) -> None:
        """Load now what the first frame would have to wait for."""

    def process(self, frame: Frame) -> Reading:
        """Measure one frame."""


def check_any_order(*, tare: bool, inputs: bool, turns: bool) -> None:
    """Check that frames may be measured in any order.

    Parameters
    ----------
    tare, inputs : bool
        Whether there is a tare, or there are external inputs.
    turns : bool
        Whether a recording has a tare or a new reference.

    Raises
    ------
    InputError
        They may not.
    """
    if tare:
        raise InputError("a tare needs the frames in order; use one worker")
    if inputs:
        raise InputError("external inputs need the frames in order; use one worker")
    if turns:
        raise InputError(
            "the recording has a tare or a new reference, which need the frames in order; "
            "use one worker"
        )


def shared_out(processor: Processor, frames: Iterable[Frame], workers: int) -> Iterator[Reading]:
    """Yield the readings of frames in order, measured by several processes.

    Each process has its own copy of the processor, so a frame cannot depend on earlier ones.

    Raises
    ------
    ChildProcessError
        A worker was killed.
    """
    pickled = pickle.dumps(processor, pickle.HIGHEST_PROTOCOL)
    left, waiting = iter(frames), deque[Future[Reading]]()
    try:
        with Workers(workers, _measuring, pickled) as crew:
            while True:
                room = _WAITING_EACH * workers - len(waiting)
                for frame in islice(left, room):
                    waiting.append(crew.submit(partial(_measure_in_worker, frame)))
                if not waiting:
                    return
                yield waiting.popleft().result()
    except ChildProcessError as error:
        raise ChildProcessError(
            "a worker process was killed, perhaps because memory ran out; use fewer workers"
        ) from error


def _measure_in_worker(frame: Frame, worker: WorkerProcess) -> Reading:
    reading = worker.ask(frame)
    assert isinstance(reading, Reading)
    return reading


def _measuring(pickled: bytes) -> Generator[Reading | None, Frame, None]:
    """Measure the frames that come."""
    processor: Processor = pickle.loads(pickled)
    frame = yield None
    while True:
        frame = yield processor.process(frame)
