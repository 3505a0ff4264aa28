"""A client of the live page that is no browser."""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

TOKEN = "a-token-for-tests"

PATIENCE_S = 20.0


def until(there: Callable[[], Any], patience_s: float = PATIENCE_S) -> Any:
    """Wait until a function returns something true, and return it."""
    end_s = time.monotonic() + patience_s
    while not (found := there()):
        assert time.monotonic() < end_s, "it did not happen in time"
        time.sleep(0.005)
    return found


class Message:
    """A message of the server, read as a browser reads it."""

    def __init__(self, data: bytes) -> None:
        (size,) = struct.unpack("<I", data[:4])
        self.header: dict[str, Any] = json.loads(data[4 : 4 + size])
        self._parts = data[4 + size :]

    def bytes(self, place: dict[str, Any]) -> bytes:
        return self._parts[place["at"] : place["at"] + place["bytes"]]

    def array(self, place: dict[str, Any]) -> NDArray[Any]:
        return np.frombuffer(self.bytes(place), place["type"]).reshape(place["shape"])

    def map(self, described: dict[str, Any]) -> NDArray[np.float64]:
        steps = self.array(described["values"]) / 65535
        return np.asarray(described["low"] + steps * (described["high"] - described["low"]))


class Watcher:
    """Watches one sensor; ``connection`` is a websocket."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self.answers: list[dict[str, Any]] = []
        self.hello: dict[str, Any] = json.loads(connection.recv(PATIENCE_S))
        self.status: dict[str, Any] = self.hello["status"]

    def next(self, *, shown: bool = True) -> Message:
        """Return the next state, and ask for another one."""
        while True:
            received = self.connection.recv(PATIENCE_S)
            if isinstance(received, bytes):
                message = Message(received)
                if shown:
                    self.shown(message)
                return message
            self._hear(received)

    def shown(self, message: Message) -> None:
        self.say(do="shown", number=message.header["number"])

    def say(self, **command: Any) -> None:
        self.connection.send(json.dumps(command))

    def ask(self, **command: Any) -> dict[str, Any]:
        """Send a command and return its answer."""
        self.say(id=77, **command)
        while True:
            for answer in self.answers:
                if answer.get("id") == 77:
                    self.answers.remove(answer)
                    return answer
            received = self.connection.recv(PATIENCE_S)
            if isinstance(received, bytes):
                self.shown(Message(received))
            else:
                self._hear(received)

    def _hear(self, received: str) -> None:
        said = json.loads(received)
        if "status" in said:
            self.status = said["status"]
        else:
            self.answers.append(said)


@contextmanager
def watching(address: str, number: int = 0) -> Iterator[Watcher]:
    """Watch a sensor of a page by its address."""
    from websockets.sync.client import connect

    url = f"ws{address.removeprefix('http')}live/{number}"
    with connect(url, compression=None, max_size=None, close_timeout=1) as connection:
        yield Watcher(connection)
