"""The light protocol: checksums, damaged lines, and the examples of its specification."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.builtin.leds.led_box import BoxInfo, LineError, checksum, decode, encode

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "light-protocol.md"
WORDS = st.lists(st.text("ABCXYZ0123456789-_.", min_size=1, max_size=8), min_size=1, max_size=9)


def test_the_checksum_is_crc_8_of_smbus() -> None:
    assert checksum(b"123456789") == 0xF4
    assert checksum(b"") == 0


@given(WORDS)
def test_what_is_encoded_is_decoded(words: list[str]) -> None:
    assert decode(encode(*words)) == tuple(words)


@given(WORDS, st.data())
def test_any_damaged_byte_is_noticed(words: list[str], data: st.DataObject) -> None:
    line = encode(*words).strip()
    at = data.draw(st.integers(0, len(line) - 4))  # before the star
    other = data.draw(st.integers(33, 126).filter(lambda byte: byte != line[at]))
    with pytest.raises(LineError):
        decode(line[:at] + bytes([other]) + line[at + 1 :])


@pytest.mark.parametrize("line", [b"", b"OK 1", b"OK 1*", b"OK 1*zz", b"*00", b"\xff\xfe*00"])
def test_other_lines_are_refused(line: bytes) -> None:
    with pytest.raises(LineError):
        decode(line)


def test_the_examples_of_the_specification_have_their_checksums() -> None:
    example = re.findall(r"```text\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)[0]
    words = [decode(line.lstrip("> ").encode()) for line in example.splitlines()]
    assert [one[0] for one in words[:4]] == ["HELLO", "HELLO", "HELLO", "SET"]
    assert BoxInfo.from_words(words[0][2:]) == BoxInfo("1.0", "L0001", 6, 0.001, 2.0)


@pytest.mark.parametrize(
    ("description", "message"),
    [
        ("1 thermometer 1.0 T1 1 1 1", "describes itself as .* not as 'tactile-lights'"),
        ("2 tactile-lights 1.0 L1 6 1 2000", "speaks version 2 of the light protocol instead of 1"),
        ("1 tactile-lights 1.0 L1", "incompletely"),
        ("1 tactile-lights 1.0 L1 six 1 2000", "incompletely"),
        ("", "describes itself as ''"),
    ],
)
def test_another_box_is_refused(description: str, message: str) -> None:
    with pytest.raises(LineError, match=message):
        BoxInfo.from_words(description.split())
