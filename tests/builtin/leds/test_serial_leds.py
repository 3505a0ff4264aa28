"""Boxes of LEDs at a serial port: pyserial, and an emulated box at a pseudo-terminal."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

if not sys.platform.startswith(("linux", "darwin")):
    pytest.skip("needs pseudo-terminals", allow_module_level=True)
pytest.importorskip("serial", reason="needs pyserial")

from support.light_box import LIGHTS, LightBox, after, light_box
from support.soak import share_of

from tactile_core.builtin.leds import serial_link
from tactile_core.builtin.leds.led_box import encode
from tactile_core.builtin.leds.serial_leds import SerialLeds
from tactile_core.errors import DeviceBusy, DeviceError
from tactile_core.testing.imports import Footprint, within

Words = tuple[str, ...]
DARK = [0] * 6


@pytest.fixture(autouse=True)
def _short_hello(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serial_link, "_HELLO_S", 0.5)
    monkeypatch.setattr(serial_link, "_ASK_S", 0.1)


@pytest.fixture
def box() -> Iterator[LightBox]:
    with light_box() as one:
        yield one


def leds(box: LightBox, **options: Any) -> SerialLeds:
    return SerialLeds(
        SerialLeds.Options(lights=LIGHTS, port=box.port, **{"timeout_s": 2.0} | options)
    )


def once(box: LightBox, fault: Callable[[Words], bytes], command: str = "SET") -> None:
    """Let the box answer one request in another way."""

    def answer(words: Words) -> bytes:
        if words[0] != command:
            return box.proper(words)
        box.answer = box.proper
        return fault(words)

    box.answer = answer


def noticed(driver: SerialLeds) -> str:
    """Wait until the driver notices a fault, and return its message."""
    while True:
        try:
            driver.check()
        except DeviceError as error:
            return str(error)
        time.sleep(0.01)


def test_lights_are_set_together_and_go_out_at_the_end(box: LightBox) -> None:
    with leds(box) as driver:
        driver.set({"led2": 1.0, "led6": 0.5})
        driver.set({"led1": 0.001})
    assert box.levels == [DARK, [0, 255, 0, 0, 0, 128], [1, 0, 0, 0, 0, 0], DARK]


def test_the_open_driver_knows_its_box(box: LightBox) -> None:
    driver = leds(box, serial="L0001")
    assert driver.watchdog_s is None
    with driver:
        assert driver.info is not None
        assert (driver.info.serial, driver.info.lights) == ("L0001", 6)
        assert driver.watchdog_s == 0.4


def test_a_box_that_restarts_when_its_port_opens_says_hello_by_itself(box: LightBox) -> None:
    box.answer = lambda words: b""

    def start() -> None:
        box.answer = box.proper
        box.say(b"\x00\xffgar" + encode("HELLO", 0, *box.description))

    starting = threading.Timer(0.2, start)
    starting.start()
    with leds(box) as driver:
        assert driver.info is not None
    starting.join()


def test_the_box_is_kept_alive_until_it_is_closed(box: LightBox) -> None:
    with leds(box) as driver:
        driver.set({"led1": 1.0})
        while box.asked.count("ALIVE") < 3:
            time.sleep(0.01)
        driver.check()
    asked = len(box.asked)
    time.sleep(0.25)
    assert len(box.asked) == asked


def test_a_closed_driver_leaves_no_thread_and_no_open_file(box: LightBox) -> None:
    leds(box).open().close()
    before = Footprint.take_snapshot()
    for _ in range(5):
        with leds(box) as driver:
            driver.set({"led1": 1.0})
    assert before.find_leaks() == ""


@pytest.mark.parametrize(
    "fault",
    [
        lambda words: encode("ERR", 0, "CHECKSUM"),
        lambda words: encode("OK", words[1]).replace(b"*", b"#"),
        lambda words: b"\xf0\x9f\n",
        lambda words: b"",
    ],
    ids=["request damaged", "answer damaged", "garbage", "answer lost"],
)
def test_one_damaged_or_lost_line_is_sent_again(
    box: LightBox, fault: Callable[[Words], bytes]
) -> None:
    with leds(box) as driver:
        once(box, fault)
        driver.set({"led3": 1.0})
        driver.check()
        assert box.levels[-1] == [0, 0, 255, 0, 0, 0]


def test_half_a_line_is_completed_by_the_other_half(box: LightBox) -> None:
    def halves(words: Words) -> bytes:
        line = encode("OK", words[1])
        box.say(line[:4])
        return after(0.05, line[4:])

    with leds(box) as driver:
        once(box, halves)
        driver.set({"led3": 1.0})
        assert box.asked.count("SET") == 2  # the dark one at the beginning, and this one


def test_a_slow_acknowledgement_of_the_first_request_counts(box: LightBox) -> None:
    with leds(box, timeout_s=1.0) as driver:
        once(box, lambda words: after(0.6, box.proper(words)))
        driver.set({"led3": 1.0})
        driver.set({"led4": 1.0})
        assert box.levels[-1] == [0, 0, 0, 255, 0, 0]


def test_a_silent_box_is_an_error_within_the_timeout(box: LightBox) -> None:
    driver = leds(box, timeout_s=0.3).open()
    box.answer = lambda words: b""
    with pytest.raises(DeviceError, match=r"does not answer within 0\.3 s; check its cable"):
        driver.set({"led1": 1.0})
    driver.close()  # known to be silent: nothing more to say
    assert not driver.is_open


def test_a_box_that_garbles_everything_is_an_error_that_quotes_it(box: LightBox) -> None:
    driver = leds(box, timeout_s=0.3).open()
    box.answer = lambda words: b"OK 1*FF\n"
    with pytest.raises(DeviceError, match=r"within 0\.3 s \(.*'OK 1\*FF' has the wrong checksum"):
        driver.set({"led1": 1.0})
    driver.close()


def test_a_box_that_refuses_is_an_error(box: LightBox) -> None:
    with leds(box) as driver:
        once(box, lambda words: encode("ERR", words[1], "LEVELS"))
        with pytest.raises(DeviceError, match=r"refuses: ERR \d+ LEVELS; upload the firmware"):
            driver.set({"led1": 1.0})


def test_a_box_that_restarts_meanwhile_is_an_error(box: LightBox) -> None:
    with leds(box) as driver:
        once(box, lambda words: encode("HELLO", 0, *box.description))
        with pytest.raises(DeviceError, match="has restarted, and its lights were out"):
            driver.set({"led1": 1.0})
        driver.set({"led1": 1.0})


def test_a_box_that_falls_silent_between_settings_is_noticed_once(box: LightBox) -> None:
    with leds(box, timeout_s=0.3) as driver:
        driver.set({"led1": 1.0})
        box.answer = lambda words: b""
        assert "does not answer" in noticed(driver)
        box.answer = box.proper
        with suppress(DeviceError):  # of the request that is under way
            driver.set({"led1": 1.0})
        driver.set({"led1": 1.0})
        driver.check()


def test_an_unplugged_box_is_an_error_and_closes(box: LightBox) -> None:
    driver = leds(box).open()
    driver.set({"led1": 1.0})
    before = Footprint.take_snapshot()
    box.unplug()
    with pytest.raises(DeviceError, match=r"was disconnected .*; plug it in and open"):
        driver.set({"led2": 1.0})
    driver.close()
    driver.close()
    assert before.find_leaks() == ""
    with pytest.raises(DeviceError, match=f"there is no serial port {box.port}"):
        driver.open()
    with light_box() as again:
        leds(again).open().close()


def test_a_box_that_is_unplugged_while_the_lights_are_on_is_reported_by_close(
    box: LightBox,
) -> None:
    driver = leds(box).open()
    driver.set({"led1": 1.0})
    box.unplug()
    with pytest.raises(DeviceError, match="was disconnected"):
        driver.close()
    assert not driver.is_open
    assert not [one for one in threading.enumerate() if "keep-alive" in one.name]


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda words: b"", "does not answer and is no box with the light protocol"),
        (lambda words: b"$GPGGA,12\r\n", r"answers b'\$GPGGA,12' and is no box"),
        (
            lambda words: encode("HELLO", words[1], 2, "tactile-lights", "2.0", "L1", 6, 1, 2000),
            "speaks version 2 of the light protocol instead of 1; upload",
        ),
        (
            lambda words: encode("HELLO", words[1], 1, "tactile-lights", "1.0", "L9", 6, 1, 2000),
            "has the serial number 'L9' instead of 'L0001'",
        ),
        (
            lambda words: encode("HELLO", words[1], 1, "tactile-lights", "1.0", "L0001", 4, 1, 9),
            "has 4 lights, but 'lights' of the light driver names 6",
        ),
    ],
    ids=["silence", "another device", "version", "serial", "lights"],
)
def test_another_device_is_not_opened(
    box: LightBox, answer: Callable[[Words], bytes], message: str
) -> None:
    box.answer = answer
    driver = leds(box, serial="L0001")
    before = Footprint.take_snapshot()
    with pytest.raises(DeviceError, match=message):
        driver.open()
    assert before.find_leaks() == ""
    box.answer = box.proper
    driver.open().close()


def test_a_port_in_use_is_busy(box: LightBox) -> None:
    with leds(box), pytest.raises(DeviceBusy, match=f"the serial port {box.port} is in use"):
        leds(box).open()


def test_an_unknown_light_is_named(box: LightBox) -> None:
    with leds(box) as driver, pytest.raises(DeviceError, match="has no light 'red'; its lights"):
        driver.set({"red": 1.0})


def test_two_outputs_cannot_have_one_name() -> None:
    with pytest.raises(ValueError, match="two outputs have the same light"):
        SerialLeds.Options(lights=("a", "a"))


def test_without_pyserial_the_command_to_install_it_is_named(
    box: LightBox, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(DeviceError, match=r"pip install 'tactile-core\[serial\]'"):
        leds(box).open()


@pytest.mark.soak
def test_a_hundred_unplugs_at_random_moments() -> None:
    random = np.random.default_rng(0)
    before = Footprint.take_snapshot()
    for _ in range(share_of(100)):
        box = LightBox()
        driver = leds(box).open()
        unplugging = threading.Timer(random.uniform(0, 0.3), box.unplug)
        unplugging.start()
        done = within(2.0, lambda driver=driver: set_until_it_fails(driver))
        assert done.ended
        assert isinstance(done.error, DeviceError)
        driver.close()
        unplugging.join()
    assert before.find_leaks() == ""


def set_until_it_fails(driver: SerialLeds) -> None:
    while True:
        driver.set({"led1": 1.0})
        driver.set({"led2": 1.0})
