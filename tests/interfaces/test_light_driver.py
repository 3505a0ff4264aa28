"""Lights obey while they are open, refuse what is no level, and go out."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from tactile_core.errors import DeviceError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.light_driver import LightDriver


class Box(LightDriver):
    """Notes what is done to it; may jam."""

    def __init__(self) -> None:
        super().__init__(Options())
        self.done: list[object] = []
        self.jammed = False

    def _open(self) -> None:
        self.done.append("open")

    def _close(self) -> None:
        self.done.append("closed")

    def _set(self, levels: Mapping[str, float]) -> None:
        if self.jammed:
            raise DeviceError("jammed")
        self.done.append(dict(levels))


def test_a_closed_light_does_not_shine() -> None:
    box = Box()
    with pytest.raises(DeviceError, match="Box is closed"):
        box.set({"white": 1.0})
    assert box.done == []


@pytest.mark.parametrize("level", [-0.1, 1.5, float("nan")])
def test_a_light_refuses_a_level_that_does_not_exist(level: float) -> None:
    with Box() as box:
        box.set({"white": 0.5})
        with pytest.raises(ValueError, match="'white'"):
            box.set({"white": level})
        assert box.done[-1] == {"white": 0.5}


def test_the_lights_go_out_before_the_driver_lets_go_of_them() -> None:
    with Box() as box:
        box.set({"white": 1.0})
    box.close()
    assert box.done == ["open", {"white": 1.0}, {}, "closed"]


def test_a_driver_that_can_no_longer_switch_is_closed_and_says_so() -> None:
    box = Box().open()
    box.jammed = True
    with pytest.raises(DeviceError, match="jammed"):
        box.close()
    assert box.done == ["open", "closed"]
    assert not box.is_open
