"""Progress reporting of long work, independent of its display."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Receives progress reports; the command line draws a bar."""

    def stage(self, words: str, share: float) -> None:
        """Start a stage that takes about this share of the whole."""

    def fraction(self, done: float) -> None:
        """Report the completed fraction of the current stage, 0..1."""


class Silent:
    """A :class:`Progress` that displays nothing."""

    def stage(self, words: str, share: float) -> None:
        """Do nothing."""

    def fraction(self, done: float) -> None:
        """Do nothing."""
