"""Whatever is raised can be said in one line."""

from __future__ import annotations

from tactile_core.errors import words_of


class Unprintable(Exception):
    def __str__(self) -> str:
        raise RuntimeError("even its words fail")


def test_an_error_is_said_in_one_line() -> None:
    assert words_of(ValueError("two\n  lines")) == "ValueError: two lines"


def test_an_error_without_a_reason_says_that_there_is_none() -> None:
    assert words_of(KeyboardInterrupt()) == "KeyboardInterrupt: no reason given"


def test_an_error_whose_own_words_fail_is_named_all_the_same() -> None:
    assert words_of(Unprintable()) == "Unprintable: no reason given"
