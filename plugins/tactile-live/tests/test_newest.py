"""The newest value, from one thread to others."""

from __future__ import annotations

import asyncio
import threading

from tactile_live.pictures import Newest


def test_only_the_newest_value_is_kept() -> None:
    newest: Newest[int] = Newest()
    for value in range(5):
        newest.put(value)
    assert asyncio.run(newest.after(0)) == (5, 4)
    assert newest.value == 4


def test_who_waits_is_woken_by_another_thread() -> None:
    newest: Newest[str] = Newest()

    async def wait() -> tuple[int, str]:
        waiting = asyncio.create_task(newest.after(0))
        await asyncio.sleep(0)
        threading.Thread(target=newest.put, args=("there",)).start()
        return await asyncio.wait_for(waiting, 10)

    assert asyncio.run(wait()) == (1, "there")


def test_who_waits_is_woken_with_the_same_value_again() -> None:
    newest: Newest[int] = Newest()
    newest.again()
    assert newest.count == 0
    newest.put(4)
    newest.again()
    assert asyncio.run(newest.after(1)) == (2, 4)


def test_who_has_left_does_not_disturb() -> None:
    newest: Newest[int] = Newest()

    async def leave() -> None:
        waiting = asyncio.create_task(newest.after(0))
        await asyncio.sleep(0)
        waiting.cancel()

    asyncio.run(leave())
    newest.put(1)  # its loop has ended
    assert newest.count == 1
