"""Which serial port is the light box: never a guess among two."""

from __future__ import annotations

import errno
from dataclasses import dataclass

import pytest

from tactile_core.builtin.leds.serial_leds import SerialLeds
from tactile_core.builtin.leds.serial_link import SerialOptions, choose, open_port
from tactile_core.errors import DeviceBusy, DeviceError
from tactile_core.interfaces.device import ConnectedDevice


@dataclass
class Port:
    """A port as pyserial lists it."""

    device: str
    vid: int | None = None
    pid: int | None = None
    serial_number: str | None = None
    location: str | None = None
    product: str | None = None


BOARD = Port("/dev/ttyS0")
UNO = Port("/dev/ttyACM0", 0x2341, 0x0043, "ARD42", "1-2.1:1.0")
OTHER_UNO = Port("/dev/ttyACM1", 0x2341, 0x0043, "ARD43", "1-2.2:1.0")
CLONE = Port("/dev/ttyUSB0", 0x1A86, 0x7523, None, "1-3")


def options(**given: str) -> SerialOptions:
    return SerialOptions.model_validate({"lights": ("a",), **given})


def test_the_only_usb_port_is_the_box() -> None:
    assert choose([BOARD, CLONE], options()) == "/dev/ttyUSB0"


@pytest.mark.parametrize(
    "given",
    [
        {"usb_serial": "ARD43"},
        {"port_path": "1-2.2"},
        {"usb_id": "2341:0043", "port_path": "1-2.2"},
    ],
)
def test_each_option_selects(given: dict[str, str]) -> None:
    assert choose([BOARD, UNO, OTHER_UNO, CLONE], options(**given)) == "/dev/ttyACM1"


def test_two_are_listed_not_guessed() -> None:
    with pytest.raises(DeviceError) as caught:
        choose([UNO, OTHER_UNO, CLONE], options(usb_id="2341:0043"))
    message = str(caught.value)
    assert "several serial ports with usb_id 2341:0043" in message
    assert "/dev/ttyACM0 (2341:0043, serial number ARD42" in message
    assert "ARD43" in message
    assert "ttyUSB0" not in message


def test_none_lists_what_there_is() -> None:
    with pytest.raises(DeviceError, match=r"with usb_serial X for .* are /dev/ttyUSB0 \(1a86:7523"):
        choose([CLONE], options(usb_serial="X"))
    with pytest.raises(DeviceError, match="no USB serial port is connected; plug it in"):
        choose([BOARD], options())


def test_a_port_that_does_not_exist_is_an_error() -> None:
    pytest.importorskip("serial", reason="needs pyserial")
    with pytest.raises(DeviceError, match="there is no serial port /dev/nowhere; plug the light"):
        open_port("/dev/nowhere", 0.1)


@pytest.mark.parametrize(
    ("number", "kind", "message"),
    [
        (errno.EACCES, DeviceError, "must not be opened; "),
        (errno.EBUSY, DeviceBusy, "is in use"),
        (errno.EIO, DeviceError, "cannot be opened: .*broken"),
    ],
)
def test_the_reason_is_explained(
    monkeypatch: pytest.MonkeyPatch, number: int, kind: type[DeviceError], message: str
) -> None:
    serial = pytest.importorskip("serial", reason="needs pyserial")

    def fails(*_: object, **__: object) -> None:
        raise serial.SerialException(number, "broken")

    monkeypatch.setattr(serial, "Serial", fails)
    with pytest.raises(kind, match=message):
        open_port("/dev/ttyACM0", 0.1)


def test_only_usb_ports_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [BOARD, UNO, CLONE])
    uno, clone = SerialLeds.connected()
    assert uno == ConnectedDevice("/dev/ttyACM0", "", "2341:0043", "ARD42", "1-2.1")
    assert (clone.serial, clone.port_path) == (None, "1-3")
    assert uno.fits({"usb_serial": "ARD42"}, SerialLeds.selectors)
    assert not clone.fits({"port": "/dev/ttyACM0"}, SerialLeds.selectors)
