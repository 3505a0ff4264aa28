"""The demonstration of several rigs, on several cores."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import ExitStack
from itertools import zip_longest

from tactile_core.evaluation.demo import STAGES, Demonstration, demonstration
from tactile_core.evaluation.own_resources import one_thread
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.pipeline.worker_process import WorkerProcess
from tactile_core.profiles.model import Profile


def demonstrate_rigs(
    profiles: Sequence[Profile], progress: Progress, *, processes: int
) -> list[Demonstration]:
    """Demonstrate rigs in several processes, each rig in one of them.

    The results do not depend on the number of processes. An exception ends all of them.

    Parameters
    ----------
    profiles : sequence of Profile
    progress : Progress
    processes : int
        1 stays in this process.

    Returns
    -------
    list of Demonstration
        In the order of the profiles.

    Raises
    ------
    TactileError
        Of the first rig that cannot be demonstrated.
    """
    shares = [profiles[first::processes] for first in range(min(processes, len(profiles)))]
    found: list[list[Demonstration]] = [[] for _ in shares]
    progress.stage(f"calibrating and measuring {len(profiles)} virtual sensors", 1.0)
    done = 0
    with ExitStack() as processes_left:
        sources = [_stages(share, processes_left, alone=len(shares) == 1) for share in shares]
        # shares take about equally long, so hardly any process waits until it is read
        for answers in zip_longest(*sources):
            for result, results in zip(answers, found, strict=True):
                if result is not None:
                    results.append(result)
            done += len(answers)
            progress.fraction(min(1.0, done / (STAGES * len(profiles))))
    return [found[number % len(shares)][number // len(shares)] for number in range(len(profiles))]


def _stages(
    profiles: Sequence[Profile], processes: ExitStack, *, alone: bool
) -> Generator[Demonstration | None, None, None]:
    """Start a process, unless there is only one, and return what its stages yield."""
    if alone:
        return _demonstrations(profiles)
    process = processes.enter_context(WorkerProcess(_demonstrations, profiles))
    stages = STAGES * len(profiles)
    for _ in range(stages - 1):
        process.send(None)  # at once: the process does not wait for this one between stages
    return (process.receive() for _ in range(stages))


def _demonstrations(profiles: Sequence[Profile]) -> Generator[Demonstration | None, None, None]:
    with one_thread():
        for profile in profiles:
            yield from demonstration(profile, Silent())
