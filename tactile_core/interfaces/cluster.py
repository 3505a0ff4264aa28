"""The cluster interface: one function on many jobs, by workers elsewhere."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Sequence
from typing import TypeVar

Job = TypeVar("Job")
Done = TypeVar("Done")


class Cluster(ABC):
    """The workers of a scheduler, which have the same packages and see the same files."""

    @abstractmethod
    def run(
        self, function: Callable[[Job], Done], jobs: Sequence[Job], address: str
    ) -> Generator[tuple[Job, Done | Exception], None, None]:
        """Call a function with each job, and yield the results as they come.

        Closing the generator forgets the jobs that no worker has begun.

        Parameters
        ----------
        function : callable
            Importable by the workers.
        jobs : sequence
            Can be pickled, like the results.
        address : str
            Of the scheduler.

        Yields
        ------
        job
        result or Exception
            Why no worker could finish the job, such as a :class:`~tactile_core.errors.TactileError`
            with a sentence.

        Raises
        ------
        InputError
            This is no address.
        TactileError
            The scheduler does not answer, or has no workers.
        """
