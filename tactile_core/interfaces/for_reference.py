"""What is prepared once for each reference."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

R = TypeVar("R")
T = TypeVar("T")


class ForReference(Generic[R, T]):
    """Caches the object that was prepared for the latest reference. Pickles drop the cache.

    Parameters
    ----------
    prepare : callable
        Maps a reference, or slopes of the reference, to the prepared object. It must pickle: a
        module's function, or a method.
    """

    def __init__(self, prepare: Callable[[R], T]) -> None:
        self._prepare = prepare
        self._kept: tuple[R, T] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": None}

    def __call__(self, reference: R) -> T:
        """Return the object for this reference; compares references by identity."""
        if self._kept is None or self._kept[0] is not reference:
            self._kept = reference, self._prepare(reference)
        return self._kept[1]
