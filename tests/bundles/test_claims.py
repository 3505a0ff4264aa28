"""Which devices belong to a unit, in a file of the user's."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.bundles.claims import Claim, Claims, DeviceKind, read_claims, write_claims
from tactile_core.errors import InputError
from tactile_core.interfaces.device import ConnectedDevice

C310 = Claim(usb_id="046d:081b", serial="C310A001", product="HD Webcam C310")
NAMELESS = Claim(usb_id="046d:081b", port_path="1-2.4")
KINDS: tuple[DeviceKind, ...] = ("camera", "light_driver")


def test_without_a_file_nothing_is_claimed(tmp_path: Path) -> None:
    assert read_claims(tmp_path / "absent.json") == Claims()


def test_what_is_written_is_read_and_readable(tmp_path: Path) -> None:
    path = tmp_path / "data" / "claims.json"
    claims = (
        Claims().give_device("F12", "camera", C310).give_device("F12", "light_driver", NAMELESS)
    )
    write_claims(claims, path)
    assert read_claims(path) == claims
    assert json.loads(path.read_text())["units"]["F12"]["light_driver"] == {
        "usb_id": "046d:081b",
        "port_path": "1-2.4",
        "product": "",
    }
    assert [file.name for file in path.parent.iterdir()] == ["claims.json"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        '{"format": 2}',
        '{"format": 1, "units": {"F12": {"camera": {"serial": 12}}}}',
        '{"format": 1, "units": {"F12": {"camera": {}}}}',
        '{"format": 1, "units": {"F12": {"gel": {"serial": "x"}}}}',
    ],
)
def test_a_damaged_file_is_refused_in_one_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "claims.json"
    path.write_text(text)
    with pytest.raises(
        InputError, match=r"claims\.json is no list of claims .*delete it"
    ) as caught:
        read_claims(path)
    assert "\n" not in str(caught.value)


def test_a_device_is_recognised_by_its_serial_wherever_it_is_plugged_in() -> None:
    moved = ConnectedDevice("/dev/video7", "", "046d:081b", "C310A001", "3-1")
    assert C310.recognises(moved)
    assert not C310.recognises(ConnectedDevice("", "", "046d:081b", "C310A002", "3-1"))
    assert not C310.recognises(ConnectedDevice("", "", "0c45:636d", "C310A001", "3-1"))


def test_a_device_without_a_serial_is_recognised_by_its_port() -> None:
    assert NAMELESS.recognises(ConnectedDevice("", "", "046d:081b", None, "1-2.4"))
    assert not NAMELESS.recognises(ConnectedDevice("", "", "046d:081b", None, "1-2.3"))


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["left", "right", "third"]),
            st.sampled_from(KINDS),
            st.sampled_from([C310, NAMELESS, Claim(serial="other")]),
        )
    )
)
def test_no_device_belongs_to_two_units_and_the_last_claim_holds(
    steps: list[tuple[str, DeviceKind, Claim]],
) -> None:
    claims = Claims()
    for unit, kind, claim in steps:
        claims = claims.give_device(unit, kind, claim)
        assert claims.devices_of(unit)[kind] == claim
    for kind in KINDS:
        held = [devices[kind] for devices in claims.units.values() if kind in devices]
        assert len(set(held)) == len(held)
    for unit in ("left", "right", "third"):
        assert claims.remove_unit(unit).devices_of(unit) == {}
