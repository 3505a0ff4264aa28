"""Why a device file cannot be opened."""

import os
from pathlib import Path

import pytest

from tactile_core.interfaces.usb_bus import RULES, holders, name_holders, permission_advice


def test_the_udev_rules_that_the_advice_names_are_in_the_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    rules = Path(permission_advice().split("cp ")[1].split(" ")[0])
    assert rules.name == RULES
    assert 'TAG+="uaccess"' in rules.read_text("utf-8")


def test_the_programs_that_hold_a_device_are_named(tmp_path: Path) -> None:
    for number, name, target in (("17", "cheese", "/dev/video0"), ("18", "bash", "/dev/tty1")):
        process = tmp_path / number
        (process / "fd").mkdir(parents=True)
        (process / "comm").write_text(f"{name}\n")
        (process / "fd" / "3").symlink_to(target)
    own = tmp_path / str(os.getpid())
    (own / "fd").mkdir(parents=True)
    (own / "fd" / "3").symlink_to("/dev/video0")
    (tmp_path / "19").mkdir()  # its descriptors may not be seen
    assert holders("/dev/video0", tmp_path) == ["cheese (process 17)"]
    assert name_holders("/dev/no/such/device") == ""
