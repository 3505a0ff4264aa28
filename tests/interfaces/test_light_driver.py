"""Light drivers: levels, errors, and switching off on close."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from tactile_core.errors import DeviceError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.light_driver import LightDriver


class Box(LightDriver):
    """Records its calls; can be made to fail."""

    def __init__(self) -> None:
        super().__init__(Options())
        self.calls: list[object] = []
        self.jammed = False

    def _open(self) -> None:
        self.calls.append("open")

    def _close(self) -> None:
        self.calls.append("closed")

    def _set(self, levels: Mapping[str, float]) -> None:
        if self.jammed:
            raise DeviceError("jammed")
        self.calls.append(dict(levels))


def test_a_closed_driver_does_not_switch_lights() -> None:
    box = Box()
    with pytest.raises(DeviceError, match="Box is closed"):
        box.set({"white": 1.0})
    assert box.calls == []


@pytest.mark.parametrize("level", [-0.1, 1.5, float("nan")])
def test_a_level_out_of_range_is_rejected(level: float) -> None:
    with Box() as box:
        box.set({"white": 0.5})
        with pytest.raises(ValueError, match="'white'"):
            box.set({"white": level})
        assert box.calls[-1] == {"white": 0.5}


def test_closing_switches_the_lights_off_first() -> None:
    with Box() as box:
        box.set({"white": 1.0})
    box.close()
    assert box.calls == ["open", {"white": 1.0}, {}, "closed"]


def test_a_driver_that_fails_to_switch_off_is_closed_with_an_error() -> None:
    box = Box().open()
    box.jammed = True
    with pytest.raises(DeviceError, match="jammed"):
        box.close()
    assert box.calls == ["open", "closed"]
    assert not box.is_open
