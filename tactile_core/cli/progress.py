"""A progress bar for work longer than a second, if stderr is a terminal."""

from __future__ import annotations

import sys
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress

PATIENCE_S = 1.0  # Time before the bar appears, s


class Bar:
    """A :class:`tactile_core.interfaces.progress.Progress` that draws on stderr."""

    def __init__(self) -> None:
        self._start = monotonic()
        self._bar: RichProgress | None = None
        self._words, self._share, self._done = "", 0.0, 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def stage(self, words: str, share: float) -> None:
        """Begin a stage that takes about this share, 0..1, of the whole work."""
        self._done += self._share
        self._words, self._share = words, share
        self.fraction(0.0)

    def fraction(self, done: float) -> None:
        """Set the completed fraction of the current stage, 0..1."""
        if self._bar is None and sys.stderr.isatty() and monotonic() - self._start > PATIENCE_S:
            self._begin()
        if self._bar is not None:
            self._bar.update(
                self._bar.task_ids[0],
                description=self._words,
                completed=self._done + done * self._share,
            )

    def _begin(self) -> None:
        from rich.console import Console
        from rich.progress import Progress as RichProgress

        self._bar = RichProgress(console=Console(stderr=True), transient=True)
        self._bar.add_task(self._words, total=1.0)
        self._bar.start()
