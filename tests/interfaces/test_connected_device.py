"""Whether a component with these options would open a device."""

from __future__ import annotations

from dataclasses import fields

import pytest
from support.desk import KINDS

from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.plugins.registry import resolve

C310 = ConnectedDevice("/dev/video0", "HD Webcam C310", "046d:081b", "A", "1-2")
SELECTORS = {"usb_id": "usb_id", "product": "product", "serial": "serial", "port": "port_path"}


@pytest.mark.parametrize(
    ("options", "fits"),
    [
        ({}, True),
        ({"serial": None, "fps": 30}, True),
        ({"usb_id": "046d:081b", "serial": "A"}, True),
        ({"product": "webcam c3"}, True),
        ({"product": "DIGIT"}, False),
        ({"serial": "a"}, False),
        ({"port": "1-2.1"}, False),
    ],
)
def test_every_given_option_must_fit(options: dict[str, object], fits: bool) -> None:
    assert C310.fits(options, SELECTORS) == fits


@pytest.mark.parametrize("use", KINDS)
def test_the_selectors_of_the_core_are_options_and_attributes(use: str) -> None:
    cls = resolve(KINDS[use], use)
    assert set(cls.selectors) <= set(cls.Options.model_fields)
    assert set(cls.selectors.values()) <= {field.name for field in fields(ConnectedDevice)}
