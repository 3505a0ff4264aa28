"""Parsing a profile's YAML 1.2, with the line and column of each value."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.errors import Place, ProfileError
from tactile_core.formats.yaml_tree import MOST_BYTES, Node, read_yaml, scalar

law = settings(deadline=None)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "p.yaml"


def read(file: Path, text: str) -> Node:
    file.write_text(text, encoding="utf-8")
    tree, problems = read_yaml(file)
    assert problems == []
    return tree


def refusals(file: Path, text: str | bytes) -> list[str]:
    """Return the problems of a file, without its folder."""
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    try:
        problems = read_yaml(file)[1]
    except ProfileError as error:
        problems = list(error.problems)
    return [str(problem).removeprefix(f"{file.parent}/") for problem in problems]


def test_every_value_has_its_line_and_column(file: Path) -> None:
    tree = read(file, "# a comment\na: 1\nb:\n  c: [2, {d: 3}]\n")
    assert tree.plain() == {"a": 1, "b": {"c": [2, {"d": 3}]}}
    assert tree.origin(("a",)) == Place(file, 2, 1)
    assert tree.origin(("b", "c")) == Place(file, 4, 3)
    assert tree.origin(("b", "c", 0)) == Place(file, 4, 7)
    assert tree.origin(("b", "c", 1, "d")) == Place(file, 4, 11)
    assert tree.origin(("b", "missing")) == Place(file, 3, 1)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12", 12),
        ("-3", -3),
        ("0x1f", 31),
        ("0o17", 15),
        ("1e-3", 0.001),
        (".5", 0.5),
        ("2.", 2.0),
        ("true", True),
        ("~", None),
        ("", None),
        ("-.inf", float("-inf")),
        ("yes", "yes"),
        ("no", "no"),
        ("on", "on"),
        ("0007", "0007"),
        ("00.5", "00.5"),
        ("1_000", "1_000"),
        ("12:30", "12:30"),
        ("0b1", "0b1"),
        ("2017-08-01", "2017-08-01"),
        ("9" * 5000, "9" * 5000),
    ],
)
def test_scalars_are_parsed_as_yaml_1_2(text: str, value: Any) -> None:
    assert scalar(text) == value
    assert type(scalar(text)) is type(value)


@law
@given(st.integers() | st.floats(allow_nan=False))
def test_numbers_are_parsed_from_their_text(number: float) -> None:
    text = str(number).replace("inf", ".inf")
    assert scalar(text) == number


def test_quoted_scalars_are_text(file: Path) -> None:
    assert read(file, "a: '12'\nb: \"true\"\nc: |\n  3\n").plain() == {
        "a": "12",
        "b": "true",
        "c": "3\n",
    }


def test_an_empty_file_is_an_empty_profile(file: Path) -> None:
    assert read(file, "# nothing yet\n").plain() == {}


def test_a_byte_order_mark_and_windows_lines_are_accepted(file: Path) -> None:
    file.write_bytes("\ufeffa: 1\r\nb: ä\r\n".encode())
    tree, _ = read_yaml(file)
    assert tree.plain() == {"a": 1, "b": "ä"}
    assert tree.origin(("a",)) == Place(file, 1, 1)


def test_a_repeated_key_is_reported_with_the_first(file: Path) -> None:
    assert refusals(file, "a: 1\nb:\n  c: 1\n  c: 2\na: 3\n") == [
        "p.yaml:4:3: b.c: repeated key; the first is on line 3",
        "p.yaml:5:1: a: repeated key; the first is on line 1",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a:\n\tb: 1\n", "p.yaml:2:1: not YAML: indented with a tab; use spaces"),
        ("a: [1\nb: 2\n", "p.yaml:2:2: not YAML: expected ',' or ']', but got ':' while"),
        ("a: b: c\n", "p.yaml:1:5: not YAML: mapping values are not allowed here"),
        ("a: 1\nb: \x01\n", "p.yaml:2:4: not YAML: control character"),
        ("- a\n- b\n", "p.yaml:1:1: the file must be a mapping of keys to values"),
        ("just words\n", "p.yaml:1:1: the file must be a mapping of keys to values"),
        ("a: 1\n---\nb: 2\n", "p.yaml:2:1: the file must be one document; remove '---'"),
        ("? [a]\n: 1\n", "p.yaml:1:3: a key must be a plain word"),
        ("a: !!python/object:os.system x\n", "p.yaml:1:1: a: tags (!…) are not used here"),
        ("%YAML 1.1\n---\na: yes\n", "p.yaml:2:1: the file must be YAML 1.2; remove '%YAML'"),
        ("a: {}\n<<: {b: 1}\n", "p.yaml:2:1: <<: merge keys are not used here; write"),
        ("a: &x 1\n", "p.yaml:1:1: a: anchors and aliases are not used here; write the"),
        (b"a: \xff\xfe\n", "p.yaml: not text in UTF-8; is this the right file?"),
        ("a: " + "[" * 80 + "]" * 80, "p.yaml:1:54: a.0: nested too deeply"),
        ("#" * (MOST_BYTES + 1), "p.yaml: too large for a profile; is this the right file?"),
    ],
)
def test_an_invalid_file_is_rejected_in_one_sentence(
    file: Path, text: str | bytes, message: str
) -> None:
    (refusal,) = refusals(file, text)
    assert refusal.startswith(message)
    assert "\n" not in refusal


def test_an_alias_bomb_is_rejected_in_one_sentence(file: Path) -> None:
    levels = "".join(
        f"l{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 9)}]\n" if i else "l0: &l0 [ha]\n"
        for i in range(12)
    )
    assert refusals(file, levels) == [
        "p.yaml:1:1: l0: anchors and aliases are not used here; write the value (a profile "
        "can use 'extends')"
    ]


def test_errors_before_a_syntax_error_are_reported_too(file: Path) -> None:
    messages = refusals(file, "a: 1\na: 2\nb: [\n")
    assert [message.split(":")[1] for message in messages] == ["2", "4"]


def test_a_missing_file_and_a_folder_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="there is no such file"):
        read_yaml(tmp_path / "gone.yaml")
    with pytest.raises(ProfileError, match="cannot be read"):
        read_yaml(tmp_path)


@law
@given(st.text(max_size=60) | st.binary(max_size=60))
def test_any_file_is_read_or_rejected(text: str | bytes) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "p.yaml"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        with suppress(ProfileError):
            assert read_yaml(file)[0].is_mapping
