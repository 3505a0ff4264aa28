"""Measures frames in parallel processes and keeps their order."""

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

from tactile_core.errors import InputError
from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Frame

_WAITING_EACH = 2
"""Frames queued per worker: enough that none is idle, few enough to save memory."""


class Processor(Protocol):
    """The part of a pipeline that a worker uses."""

    compiled: bool

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
    # "spawn": a forked process would inherit locks that its missing threads can never release
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
            "a worker process was killed, perhaps because memory ran out; use fewer workers"
        ) from error
    finally:
        pool.shutdown(cancel_futures=True)


_mine: list[Processor] = []
"""The processor of this worker process; a pool's initializer can set it only globally."""


def _begin(pickled: bytes) -> None:
    # Ctrl-C is handled by the process that consumes the readings
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _mine[:] = [pickle.loads(pickled)]
    if _mine[0].compiled:
        _mine[0].warm()


def _measured(frame: Frame) -> Reading:
    return _mine[0].process(frame)
