"""An emulated light box at a pseudo-terminal, and what can be wrong with one."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from select import select
from threading import Thread

from tactile_core.builtin.leds.led_box import LineError, decode, encode

LIGHTS = ("led1", "led2", "led3", "led4", "led5", "led6")


class LightBox:
    """Answers like the firmware, unless ``answer`` is replaced.

    Attributes
    ----------
    port : str
        Name of its serial port.
    levels : list of list of int
        What it was set to.
    asked : list of str
        Commands that it received.
    answer : callable
        Returns what the box says to the words of a request.
    """

    def __init__(self, lights: int = 6, description: str = "1 tactile-lights 1.0 L0001") -> None:
        import tty  # there is none on Windows

        self._master, self._slave = os.openpty()
        for end in (self._master, self._slave):
            tty.setraw(end)
        self.port = os.ttyname(self._slave)
        self.description = f"{description} {lights} 1 400".split()
        self.levels: list[list[int]] = []
        self.asked: list[str] = []
        self.answer: Callable[[tuple[str, ...]], bytes] = self.proper
        self._running = True
        self._thread = Thread(target=self._serve)
        self._thread.start()

    def proper(self, words: tuple[str, ...]) -> bytes:
        """What a good box says."""
        command, number, *levels = words
        if command == "HELLO":
            return encode("HELLO", number, *self.description)
        if command == "SET":
            self.levels.append([int(level) for level in levels])
        return encode("OK", number)

    def say(self, data: bytes) -> None:
        """Send something unasked."""
        os.write(self._master, data)

    def unplug(self) -> None:
        """Remove the port."""
        self._running = False
        self._thread.join()
        for end in {self._master, self._slave} - {-1}:
            os.close(end)
        self._master = self._slave = -1

    def _serve(self) -> None:
        received = b""
        while self._running:
            if not select([self._master], [], [], 0.01)[0]:
                continue
            received += os.read(self._master, 256)
            *lines, received = received.split(b"\n")
            for line in filter(None, lines):
                try:
                    words = decode(line)
                except LineError:
                    self.say(encode("ERR", 0, "CHECKSUM"))
                    continue
                self.asked.append(words[0])
                self.say(self.answer(words))


@contextmanager
def light_box(**options: object) -> Iterator[LightBox]:
    """A box that is unplugged at the end."""
    box = LightBox(**options)  # type: ignore[arg-type]
    try:
        yield box
    finally:
        box.unplug()


def after(delay_s: float, data: bytes) -> bytes:
    """Return data after a delay."""
    time.sleep(delay_s)
    return data
