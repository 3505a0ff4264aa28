"""Frames measured by several processes at once, in their order."""

from __future__ import annotations

import pickle
import signal
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from multiprocessing import get_context
from typing import Protocol

from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Frame

_WAITING_EACH = 2
"""Frames that wait for each worker, so that none is idle and few are in memory."""


class Processor(Protocol):
    """A pipeline, as far as a worker needs it."""

    def process(self, frame: Frame) -> Reading:
        """Measure one frame."""


def shared_out(processor: Processor, frames: Iterable[Frame], workers: int) -> Iterator[Reading]:
    """Yield the reading of each frame, in order, measured by as many processes.

    Each has a copy of the processor, so that no frame may depend on those before it.

    Raises
    ------
    ChildProcessError
        A worker was killed.
    """
    # started afresh: a copy of this process would have its threads' locks without its threads
    pool = ProcessPoolExecutor(
        workers, get_context("spawn"), initializer=_begin, initargs=(pickle.dumps(processor),)
    )
    left, waiting = iter(frames), deque[Future[Reading]]()
    try:
        while True:
            room = _WAITING_EACH * workers - len(waiting)
            waiting.extend(pool.submit(_measured, frame) for frame in islice(left, room))
            if not waiting:
                return
            yield waiting.popleft().result()
    except BrokenProcessPool as error:
        raise ChildProcessError(
            "a worker process ended before it was done, perhaps for want of memory; try fewer "
            "workers"
        ) from error
    finally:
        pool.shutdown(cancel_futures=True)


_mine: list[Processor] = []
"""The one of this worker process; a pool has no other way to give each process a value."""


def _begin(pickled: bytes) -> None:
    # the user's Ctrl-C goes to the process that asked for the readings
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _mine[:] = [pickle.loads(pickled)]


def _measured(frame: Frame) -> Reading:
    return _mine[0].process(frame)
