"""Who may come in."""

from __future__ import annotations

import stat
import sys
from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_live.guiding import Gate, names_of, own_token

GATE = Gate.for_port("secret", 8750, ["127.0.0.1", "localhost"])


def test_who_knows_the_token_and_comes_from_the_page_comes_in() -> None:
    assert GATE.refusal("/secret/", "127.0.0.1:8750", None) == ""
    assert GATE.refusal("/secret/live/0", "LocalHost:8750", "http://localhost:8750") == ""
    assert GATE.inside("/secret/live/0?x=1") == "live/0"
    assert GATE.inside("/secret") == ""


@pytest.mark.parametrize(
    ("path", "host", "origin", "why"),
    [
        ("/secret/", None, None, "not the host"),
        ("/secret/", "evil.example:8750", None, "not the host"),
        ("/secret/", "127.0.0.1:8751", None, "not the host"),
        ("/secret/", "127.0.0.1:8750", "http://evil.example", "Another site"),
        ("/secret/", "127.0.0.1:8750", "https://127.0.0.1:8750", "Another site"),
        ("/secret/", "127.0.0.1:8750", "null", "Another site"),
        ("/secret/", "127.0.0.1:8750", "http://127.0.0.1:87501", "Another site"),
        ("/secret/", "127.0.0.1:8750", "http://localhost:8750.evil.example", "Another site"),
        ("/secret/", "127.0.0.1:8750.evil.example", None, "not the host"),
        ("/secre/", "127.0.0.1:8750", None, "no valid token"),
        ("/secrett/", "127.0.0.1:8750", None, "no valid token"),
        ("secret/", "127.0.0.1:8750", None, "no valid token"),
        ("*", "127.0.0.1:8750", None, "no valid token"),
        ("", "127.0.0.1:8750", None, "no valid token"),
    ],
)
def test_everybody_else_stays_out(
    path: str, host: str | None, origin: str | None, why: str
) -> None:
    assert why in GATE.refusal(path, host, origin)


def test_a_token_is_made_once_and_only_its_user_can_read_it(tmp_path: Path) -> None:
    token = own_token(tmp_path / "data")
    assert len(token) == 43
    assert own_token(tmp_path / "data") == token
    assert own_token(tmp_path / "other") != token
    if sys.platform != "win32":
        mode = (tmp_path / "data" / "live-page-token").stat().st_mode
        assert stat.S_IMODE(mode) == 0o600


@pytest.mark.parametrize("content", ["", "short", "x" * 42, "a/b" * 20, "ä" * 43])
def test_a_spoilt_token_is_replaced(tmp_path: Path, content: str) -> None:
    (tmp_path / "live-page-token").write_text(content, encoding="utf-8")
    assert len(own_token(tmp_path)) == 43


@pytest.mark.parametrize(
    ("host", "names"),
    [
        ("127.0.0.1", ["127.0.0.1", "localhost"]),
        ("localhost", ["localhost", "127.0.0.1"]),
        ("::1", ["::1", "localhost"]),
        ("192.168.1.5", ["192.168.1.5"]),
        ("lab-pc", ["lab-pc"]),
    ],
)
def test_the_names_of_an_address(host: str, names: list[str]) -> None:
    assert names_of(host) == names


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_every_address_has_no_names(host: str) -> None:
    with pytest.raises(InputError, match="every address"):
        names_of(host)


def test_an_address_of_the_newer_kind_is_in_brackets() -> None:
    gate = Gate.for_port("secret", 80, ["::1"])
    assert gate.refusal("/secret/", "[::1]:80", None) == ""
    assert gate.refusal("/secret/", "[::1]", None) == ""
