"""Every exception can be described in one line."""

from __future__ import annotations

from tactile_core.errors import words_of


class Unprintable(Exception):
    def __str__(self) -> str:
        raise RuntimeError("printing fails")


def test_an_error_is_described_in_one_line() -> None:
    assert words_of(ValueError("two\n  lines")) == "ValueError: two lines"


def test_an_error_without_a_message_has_no_reason() -> None:
    assert words_of(KeyboardInterrupt()) == "KeyboardInterrupt: no reason given"


def test_an_error_that_cannot_be_printed_is_named() -> None:
    assert words_of(Unprintable()) == "Unprintable: no reason given"
