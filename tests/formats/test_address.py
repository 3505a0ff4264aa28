"""No secret of an address is written or said."""

from __future__ import annotations

import pytest

from tactile_core.formats.catalog import hide_secrets, without_secrets


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("http://host:8080/stream", "http://host:8080/stream"),
        ("http://[::1]:80/a@2x.jpg", "http://[::1]:80/a@2x.jpg"),
        ("http://me:secret@host/", "http://host/"),
        ("rtsp://me:se@cret@host/a", "rtsp://host/a"),
        ("rtsp://me:se/cret@host/a", "rtsp://host/a"),
        ("rtsp://me:se?c#ret@host/a", "rtsp://host/a"),
        ("http://secret@host", "http://host"),
        ("http://host/?user=me&password=secret", "http://host/"),
        ("http://host?action=stream&token=secret&fps=30", "http://host?action=stream&fps=30"),
        ("http://host/a?secret", "http://host/a"),
        ("http://host/a#secret", "http://host/a"),
        ("rtsp://h:554/user=me&password=secret&channel=1/x.sdp", "rtsp://h:554/channel=1/x.sdp"),
        ("rtsp://h/user=me;password=secret/x.sdp", "rtsp://h/x.sdp"),
        ("http://host/a?email=me@x.org&password=secret", "http://host/a"),
        ("me:secret@host/a", "host/a"),
        ("/cam1", "/cam1"),
    ],
)
def test_what_chooses_the_picture_stays_and_secrets_go(address: str, shown: str) -> None:
    assert without_secrets(address) == shown


def test_addresses_anywhere_in_values_lose_their_secrets() -> None:
    values = {
        "url": "http://me:se cret@host/a",
        "notes": ["as http://me:secret@host/a?key=secret shows", 3, None],
        "name": "me@host",
    }
    assert hide_secrets(values) == {
        "url": "http://host/a",
        "notes": ["as http://host/a shows", 3, None],
        "name": "me@host",
    }
