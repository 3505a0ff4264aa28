"""One page that watches one sensor: pictures out, commands in."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from tactile_core.acquisition.free_running import HOST
from tactile_core.errors import TactileError, words_of
from tactile_live.commands import AnyCommand, MoveCommand, Shown, Want, read_command
from tactile_live.desk import Desk
from tactile_live.live_sensor import LiveState
from tactile_live.shown_state import View, encoded_state

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection


class PageSession:
    """Sends the newest state whenever the page has shown the one before, and obeys its commands.

    Parameters
    ----------
    desk : Desk
        Of the sensor.
    number : int
        Of the sensor on the page.
    connection : ServerConnection
    """

    def __init__(self, desk: Desk, number: int, connection: ServerConnection) -> None:
        self._desk, self._number, self._connection = desk, number, connection
        self._view, self._period_s = View(), 0.0
        self._shown = asyncio.Event()
        self._status: dict[str, Any] = {}
        # [commands] of one page that wait
        self._commands: asyncio.Queue[AnyCommand] = asyncio.Queue(8)

    async def run(self) -> None:
        """Serve the page until it leaves."""
        await self._say(await asyncio.to_thread(self._desk.describe_page, self._number))
        tasks = [asyncio.create_task(work()) for work in (self._send_states, self._obey)]
        try:
            async for message in self._connection:
                await self._receive(message)
        finally:
            for task in tasks:
                task.cancel()
            for task in tasks:
                with suppress(asyncio.CancelledError, Exception):
                    await task

    async def _receive(self, message: str | bytes) -> None:
        try:
            command = read_command(message)
        except TactileError as error:
            await self._say({"refused": str(error)})
            return
        if isinstance(command, Shown):
            self._shown.set()
        elif isinstance(command, Want):
            self._view = View(tuple(command.maps), command.channel)
            self._period_s = 1 / command.pictures_per_s
        elif isinstance(command, MoveCommand):
            await self._do(command)
        else:
            try:
                self._commands.put_nowait(command)
            except asyncio.QueueFull:
                await self._say({"id": command.id, "refused": "too many commands wait already"})

    async def _obey(self) -> None:
        while True:
            await self._do(await self._commands.get())

    async def _do(self, command: AnyCommand) -> None:
        try:
            done = await self._desk.do(command)
        except TactileError as error:
            await self._say({"id": command.id, "refused": str(error)})
        except OSError as error:
            await self._say({"id": command.id, "refused": error.strerror or str(error)})
        except Exception as error:
            await self._say({"id": command.id, "refused": words_of(error)})
        else:
            if not isinstance(command, MoveCommand):
                await self._say_status()
            await self._say({"id": command.id, "done": done})

    async def _send_states(self) -> None:
        live, count, sent = self._desk.live, 0, 0
        while True:
            began_s = HOST.now()
            count, state = await live.newest.after(count)
            message = await asyncio.to_thread(self._encode_state, state, sent)
            sent = state.number
            self._shown.clear()
            await self._say_status()
            await self._connection.send(message)
            await self._shown.wait()
            self._desk.note_delay(1e3 * (HOST.now() - state.taken_s))
            await asyncio.sleep(max(0.0, self._period_s - (HOST.now() - began_s)))

    def _encode_state(self, state: LiveState, sent: int) -> bytes:
        """Encode a state; only called when the page is ready for it."""
        samples = self._desk.live.samples_between(sent, state.number)
        return encoded_state(state, self._view, samples)

    async def _say_status(self) -> None:
        """Say what the buttons show, if it has changed.

        Apart from the pictures: one that was encoded before a command must not undo its answer.
        """
        status = self._desk.status()
        if status != self._status:
            self._status = status
            await self._say({"status": status})

    async def _say(self, words: dict[str, Any]) -> None:
        await self._connection.send(json.dumps(words, allow_nan=False))
