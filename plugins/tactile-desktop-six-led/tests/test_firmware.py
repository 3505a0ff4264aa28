"""The firmware of the six-LED ring, compiled for its processor, answers the driver."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("serial", reason="needs pyserial")
from support.avr_board import Board, compile_board, compile_firmware, missing

from tactile_core.builtin.leds.led_box import LineError, decode, encode
from tactile_core.builtin.leds.serial_leds import SerialLeds
from tactile_core.builtin.leds.serial_link import SerialLink, open_port

pytestmark = pytest.mark.skipif(
    bool(missing()), reason=f"needs {missing()}: apt install gcc gcc-avr avr-libc simavr"
)
SKETCH = Path(__file__).parents[1] / "firmware" / "main.cpp"
LIGHTS = ("led1", "led2", "led3", "led4", "led5", "led6")
PINS = (3, 5, 6, 9, 10, 11)
TIMEOUT_S = 4.0
"""Simulated time may pass slowly."""


BAD = {
    b"SET 1 255 0 0 0 0 0*00\n": ("ERR", "0", "CHECKSUM"),
    b"S" * 90 + b"\n": ("ERR", "0", "LENGTH"),
    encode("SET", 5, 255): ("ERR", "5", "LEVELS"),
    encode("SET", 5, 255, 0, 0, 0, 0, 0, 0): ("ERR", "5", "LEVELS"),
    encode("SET", 5, 256, 0, 0, 0, 0, 0): ("ERR", "5", "LEVELS"),
    encode("SET", 5, "x", 0, 0, 0, 0, 0): ("ERR", "5", "LEVELS"),
    encode("SING", 5): ("ERR", "5", "COMMAND"),
    encode("SET"): ("ERR", "0", "COMMAND"),
    encode("SET", 0, 1, 1, 1, 1, 1, 1): ("ERR", "0", "COMMAND"),
}
"""Bad requests and their answers."""


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("avr")
    firmware = compile_firmware(SKETCH, folder / "firmware.elf", SERIAL_NUMBER='"RING-7"')
    return compile_board(folder / "board"), firmware


@pytest.fixture
def board(programs: tuple[Path, Path]) -> Iterator[Board]:
    board = Board(*programs)
    yield board
    board.close()


def ring(board: Board) -> SerialLeds:
    options = SerialLeds.Options(
        lights=LIGHTS, port=board.port, serial="RING-7", timeout_s=TIMEOUT_S
    )
    return SerialLeds(options)


def wait_until_dark(board: Board) -> None:
    while any(board.look().values()):
        time.sleep(0.02)


def test_each_light_is_at_its_pin_when_the_driver_returns(board: Board) -> None:
    with ring(board) as driver:
        assert driver.info is not None
        assert (driver.info.serial, driver.info.lights) == ("RING-7", 6)
        for name, pin in zip(LIGHTS, PINS, strict=True):
            driver.set({name: 1.0})
            assert {at: level for at, level in board.look().items() if level} == {pin: 255}
        driver.set(dict(zip(LIGHTS, (0.2, 0.4, 0.6, 0.8, 1.0, 0.002), strict=True)))
        assert board.look() == dict(zip(PINS, (51, 102, 153, 204, 255, 1), strict=True))
    assert not any(board.look().values())


def test_a_killed_program_leaves_no_light_on(board: Board) -> None:
    program = f"""
from tactile_core.builtin.leds.serial_leds import SerialLeds
options = dict(lights={LIGHTS!r}, port={board.port!r}, timeout_s={TIMEOUT_S})
driver = SerialLeds(SerialLeds.Options(**options)).open()
driver.set(dict(led1=1.0, led5=0.5))
print("on", flush=True)
import time; time.sleep(600)
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"on\n"
        assert {pin for pin, level in board.look().items() if level} == {3, 10}
        process.kill()
    wait_until_dark(board)
    with ring(board) as driver:
        driver.set({"led2": 1.0})
        assert board.look()[5] == 255


def test_the_lights_go_out_two_seconds_after_the_last_request(board: Board) -> None:
    link = SerialLink(open_port(board.port, TIMEOUT_S), board.port, TIMEOUT_S)
    link.set_levels(bytes([255, 0, 0, 0, 0, 0]))
    wait_until_dark(board)
    on, off = board.changes
    assert (on.level, off.level) == (255, 0)
    assert off.time_s - on.time_s == pytest.approx(link.info.watchdog_s, rel=0.05)
    link.set_levels(bytes([0, 9, 0, 0, 0, 0]))
    assert board.look() == {3: 0, 5: 9}
    link.close()


def test_the_driver_keeps_the_lights_on(board: Board) -> None:
    with ring(board) as driver:
        driver.set({"led1": 1.0})
        board.look()
        until_s = board.time_s + 2.5  # the watchdog waits for 2 s
        while board.time_s < until_s:
            time.sleep(0.1)
            driver.check()
            assert board.look() == {3: 255}


def answer_at(port: Any) -> tuple[str, ...]:
    """Return the next answer; leave out a late hello, which may be cut at its beginning."""
    while True:
        try:
            words = decode(port.read_until())
        except LineError:
            continue
        if words[0] != "HELLO":
            return words


def test_a_bad_request_changes_no_light(board: Board) -> None:
    port = open_port(board.port, TIMEOUT_S)
    SerialLink(port, board.port, TIMEOUT_S)
    port.timeout = TIMEOUT_S
    for line, answer in BAD.items():
        port.write(line)
        assert answer_at(port) == answer, line
    assert not any(board.look().values())
    port.close()
