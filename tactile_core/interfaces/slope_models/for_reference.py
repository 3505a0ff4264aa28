"""A cache of one entry: the object that a model prepares for the current reference."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from tactile_core.quantities import Reference

T = TypeVar("T")


class ForReference(Generic[T]):
    """Caches the object that was prepared for the latest reference. Pickles drop the cache.

    Parameters
    ----------
    prepare : callable
        Maps a reference to the prepared object. It must pickle: a module's function, or a method.
    """

    def __init__(self, prepare: Callable[[Reference], T]) -> None:
        self._prepare = prepare
        self._kept: tuple[Reference, T] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": None}

    def __call__(self, reference: Reference) -> T:
        """Return the object for this reference; compares references by identity."""
        if self._kept is None or self._kept[0] is not reference:
            self._kept = reference, self._prepare(reference)
        return self._kept[1]
