"""Values in messages are short, on one line and free of control characters."""

from __future__ import annotations

import pytest

from tactile_core.formats.text import printable, shorten_repr


@pytest.mark.parametrize(
    ("value", "text"),
    [("fine", "'fine'"), (1.5, "1.5"), ([1, 2], "[1, 2]"), (None, "None"), ("mm²", "'mm²'")],
)
def test_a_short_value_is_shown_as_its_repr(value: object, text: str) -> None:
    assert shorten_repr(value) == text


def bomb(levels: int) -> list[object]:
    value: list[object] = ["x"] * 10
    for _ in range(levels):
        value = [value] * 10
    return value


@pytest.mark.parametrize(
    "value",
    ["x" * 10**6, list(range(10**5)), bomb(30), 10**5000, {1: bomb(9)}],
    ids=["text", "list", "bomb", "number", "mapping"],
)
def test_a_large_value_is_shortened_without_formatting_it_fully(value: object) -> None:
    assert len(shorten_repr(value)) <= 120


@pytest.mark.parametrize("text", ["\x1b[31m", "a\nb", "\u2028", "\x85", "\udcff", "\x07", "\u202e"])
def test_control_characters_are_escaped(text: str) -> None:
    for safe in (
        printable(text),
        shorten_repr(text),
        shorten_repr([text]),
        shorten_repr({text: text}),
    ):
        assert safe.isprintable()
        assert "\\" in safe
    assert printable("Fläche: 3 mm²") == "Fläche: 3 mm²"
