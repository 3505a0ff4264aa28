"""A place for the newest value, from the thread that measures to those that show it."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from threading import Lock
from typing import Generic, TypeVar

T = TypeVar("T")
Waiting = tuple[asyncio.AbstractEventLoop, asyncio.Future[None]]


class Newest(Generic[T]):
    """Holds the newest value; older ones are forgotten, so that nobody can lag behind.

    Putting a value never blocks and costs nothing while nobody waits.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._count = 0
        self._value: T | None = None
        self._waiting: list[Waiting] = []

    @property
    def value(self) -> T | None:
        """The newest value; None before the first."""
        return self._value

    @property
    def count(self) -> int:
        """Number of values until now."""
        return self._count

    def put(self, value: T) -> None:
        """Replace the value, and wake those who wait; may be called from any thread."""
        with self._lock:
            self._count, self._value = self._count + 1, value
            waiting, self._waiting = self._waiting, []
        _wake_all(waiting)

    def again(self) -> None:
        """Wake those who wait, with the value that there is; may be called from any thread."""
        with self._lock:
            if self._value is None:
                return
            self._count += 1
            waiting, self._waiting = self._waiting, []
        _wake_all(waiting)

    async def after(self, count: int) -> tuple[int, T]:
        """Wait for a value newer than the one of this count, and return the newest."""
        while True:
            with self._lock:
                if self._count > count and self._value is not None:
                    return self._count, self._value
                loop = asyncio.get_running_loop()
                future: asyncio.Future[None] = loop.create_future()
                self._waiting.append((loop, future))
            await future


def _wake_all(waiting: list[Waiting]) -> None:
    for loop, future in waiting:
        with suppress(RuntimeError):  # its loop has ended
            loop.call_soon_threadsafe(_wake, future)


def _wake(future: asyncio.Future[None]) -> None:
    if not future.done():
        future.set_result(None)
