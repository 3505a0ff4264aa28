"""The undeformed gel behind a touch, and what has changed."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from operator import methodcaller
from traceback import format_exception
from typing import Any, ParamSpec, TypeVar

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Bool, Float64
from tactile_core.calibration.guided.examination import Examiner, TouchBench, Verdict
from tactile_core.pipeline.workers import WorkerProcess
from tactile_core.quantities import Frame, Reference

P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def naming_a_kill() -> Iterator[None]:
    """Say in words that a process was killed.

    Raises
    ------
    ChildProcessError
        A process of the background was killed.
    """
    try:
        yield
    except ChildProcessError as error:
        raise ChildProcessError(
            "a process that judges presses was killed, perhaps because memory ran out; the session "
            "so far is recorded: fit it with 'tactile calibrate --presses'"
        ) from error


class AtOnce:
    """Does all work in the call itself: for tests and simulated time."""

    def __init__(self, bench: TouchBench) -> None:
        self._examiner = Examiner(bench)

    def examine(self, name: str, frame: Frame) -> Future[Verdict]:
        """Judge a still frame, together with those kept before."""
        return _done(self._examiner.examine, name, frame)

    def score(self, name: str) -> Future[float | None]:
        """Score a press that was kept with a calibration on all before it."""
        return _done(self._examiner.score, name)

    def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the final fit, and wait for it."""
        return work(*args, **kwargs)

    def close(self) -> None:
        """Do nothing: all work is done."""


class InProcess:
    """Does as :class:`AtOnce`, but in another process, which a thread asks.

    The thread alone would delay live frames, because Python runs one thread at a time.
    """

    def __init__(self, bench: TouchBench) -> None:
        self._worker = WorkerProcess(_working, pickle.dumps(bench))
        self._thread = ThreadPoolExecutor(1)
        self._thread.submit(self._worker.receive)  # it is ready

    def examine(self, name: str, frame: Frame) -> Future[Verdict]:
        """Judge a still frame, together with those kept before."""
        return self._submit_call("examine", name, frame)

    def score(self, name: str) -> Future[float | None]:
        """Score a press that was kept with a calibration on all before it."""
        return self._submit_call("score", name)

    def run(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Run the final fit, and wait for it."""
        fitted: T = self._submit_call("run", work, *args, **kwargs).result()
        return fitted

    def close(self) -> None:
        """Give up what is unfinished."""
        self._thread.shutdown(wait=False, cancel_futures=True)
        self._worker.close()

    def _submit_call(self, name: str, *args: Any, **kwargs: Any) -> Future[Any]:
        return self._thread.submit(self._answer, methodcaller(name, *args, **kwargs))

    def _answer(self, call: Callable[[AtOnce], Any]) -> Any:
        answer = self._worker.ask(call)
        if isinstance(answer, Exception):
            raise answer
        return answer


def _working(pickled: bytes) -> Generator[Any, Callable[[AtOnce], Any], None]:
    """Make the calls that come; one that fails loses nothing of what was judged before."""
    at_once = AtOnce(pickle.loads(pickled))
    call = yield None
    while True:
        try:
            answer = call(at_once)
            answer = answer.result() if isinstance(answer, Future) else answer
        except Exception as error:
            error.add_note("".join(format_exception(error)))
            answer = error
        call = yield answer


def _done(work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
    future: Future[Any] = Future()
    try:
        future.set_result(work(*args, **kwargs))
    except Exception as error:  # as a process would hand it on
        future.set_exception(error)
    return future


@dataclass(frozen=True, eq=False)
class TouchChange:
    """Change of one frame.

    Attributes
    ----------
    log_ratio : (h, w, K) float32
        Logarithm of frame over reference in each cell, less its median over the image.
    light : (K,) float32
        That median: the change of the light.
    strength : float
        Largest change, averaged over a part of the ball; 0.1 is a change by a tenth.
    middle_px : (2,) float64
        Middle of the imprint, in image pixels.
    imprint : (h, w) bool
        Cells of the imprint.
    """

    log_ratio: np.ndarray
    light: np.ndarray
    strength: float
    middle_px: Float64
    imprint: Bool

    def motion(self, earlier: TouchChange) -> float:
        """Return how much the imprint differs from an earlier one, relative to its strength."""
        where = self.imprint | earlier.imprint
        now, before = self.log_ratio[where], earlier.log_ratio[where]
        total = float((now**2).sum() + (before**2).sum())
        return float(np.sqrt(2 * ((now - before) ** 2).sum() / total)) if total > 0 else 0.0


class UndeformedCells:
    """The reference on the cells with which live frames are compared.

    Parameters
    ----------
    reference : Reference
    ball_radius_px : float
    """

    def __init__(self, reference: Reference, ball_radius_px: float) -> None:
        rows, columns = reference.pixels.shape[:2]
        # [cells per ball radius] Size of the cells: a contact is at least a few cells wide.
        # [count] Cells along the longer side, at most, so that a small ball costs no more time.
        side = max(ball_radius_px / 5.0, max(rows, columns) / 96)
        self._size = max(1, round(columns / side)), max(1, round(rows / side))
        self._scale = columns / self._size[0], rows / self._size[1]
        # [ball radii] Radius over which the change is averaged before it is called a contact.
        # Source: that of the circle search (``START.blur_radii``).
        self._blur = max(0.5, 0.35 * ball_radius_px / self._scale[0])
        # [share of the full scale] Added to both intensities before the logarithm, which would
        # dwell on noise in the dark. Source: by hand.
        self._offset = 0.02 * reference.full_scale
        self._undeformed = np.log(self._cells(reference.pixels))

    def change(self, frame: Frame) -> TouchChange:
        """Compare a frame with the reference."""
        ratio = np.log(self._cells(frame.pixels)) - self._undeformed
        light = np.median(ratio, axis=(0, 1))
        ratio -= light
        energy = np.asarray(cv2.GaussianBlur((ratio**2).sum(2), (0, 0), self._blur))
        top = float(energy.max())
        # [share of the strongest change] Cells with a larger change belong to the imprint.
        imprint = energy > 0.35**2 * top
        weight = np.where(imprint, energy, 0)
        total = max(float(weight.sum()), 1e-30)
        y, x = np.mgrid[: energy.shape[0], : energy.shape[1]]
        middle = np.array([(weight * x).sum(), (weight * y).sum()]) / total
        middle_px = (middle + 0.5) * self._scale - 0.5
        return TouchChange(ratio, light, float(np.sqrt(top)), middle_px, imprint)

    def _cells(self, pixels: np.ndarray) -> np.ndarray:
        cells = shrink_image(pixels, self._size).astype(np.float32)
        return cells.reshape(*cells.shape[:2], -1) + np.float32(self._offset)
