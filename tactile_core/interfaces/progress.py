"""How long work tells how far it is, without knowing who listens."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Listens to long work; the command line draws a bar."""

    def stage(self, words: str, share: float) -> None:
        """A stage begins that takes about this share of the whole."""

    def fraction(self, done: float) -> None:
        """So much of the present stage is done, 0..1."""


class Silent:
    """A :class:`Progress` that nobody watches."""

    def stage(self, words: str, share: float) -> None:
        """Ignore it."""

    def fraction(self, done: float) -> None:
        """Ignore it."""
