"""What a model prepares for one reference, kept from frame to frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from tactile_core.quantities import Reference

T = TypeVar("T")


class ForReference(Generic[T]):
    """Keeps what was prepared for the latest reference; a pickle of it keeps nothing.

    Parameters
    ----------
    prepare : callable
        What to prepare, of a reference. It pickles: a function of a module, or a method.
    """

    def __init__(self, prepare: Callable[[Reference], T]) -> None:
        self._prepare = prepare
        self._kept: tuple[Reference, T] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": None}

    def __call__(self, reference: Reference) -> T:
        """Return what is prepared for this very reference."""
        if self._kept is None or self._kept[0] is not reference:
            self._kept = reference, self._prepare(reference)
        return self._kept[1]
