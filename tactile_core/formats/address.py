"""Addresses without the secrets that they carry."""

from __future__ import annotations

import re
from typing import Any

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_ADDRESS = re.compile(_SCHEME.pattern + r"\S*")
_HOST = re.compile(r"(?:[^:\[\]]*|\[.*\])(?::\d*)?")

# fmt: off
_HARMLESS = frozenset(
    {"action", "camera", "cam", "channel", "ch", "codec", "compression", "device", "format",
     "fps", "framerate", "height", "input", "profile", "quality", "resolution", "rotation",
     "source", "stream", "subtype", "view", "width"}
)
# fmt: on
"""Keys that choose a picture; the value of any other may be a password."""


def without_secrets(address: str) -> str:
    """Return an address without user, password, and values that may be secret.

    The user and the password end at the last ``@`` before the path, and at the last of all if
    they contain a slash. Of ``key=value`` in query and path, what chooses a picture stays, such as
    ``channel=1``.
    """
    scheme = _SCHEME.match(address)
    begin = 0 if scheme is None else scheme.end()
    start, rest = address[:begin], address[begin:]
    authority = rest.partition("/")[0]
    if "@" in authority:
        rest = authority.rpartition("@")[2] + rest[len(authority) :]
    elif not _HOST.fullmatch(re.split("[?#]", authority)[0]):
        rest = rest.rpartition("@")[2]
    place, _, query = rest.partition("#")[0].partition("?")
    kept = [pair for pair in re.split("[&;]", query) if _is_harmless(pair)]
    folders = [part for part in place.split("/") if "=" not in part or _kept(part)]
    return start + "/".join(map(_kept, folders)) + ("?" + "&".join(kept) if kept else "")


def hide_secrets(value: Any) -> Any:
    """Return JSON-ready values in which no address has a secret."""
    if isinstance(value, dict):
        return {key: hide_secrets(one) for key, one in value.items()}
    if isinstance(value, list):
        return [hide_secrets(one) for one in value]
    if not isinstance(value, str):
        return value
    if _SCHEME.match(value):  # all of it, for a password may contain a space
        return without_secrets(value)
    return _ADDRESS.sub(lambda found: without_secrets(found[0]), value)


def _kept(part: str) -> str:
    """Return a part of the path with its harmless pairs only."""
    if "=" not in part:
        return part
    return "&".join(pair for pair in re.split("[&;]", part) if _is_harmless(pair))


def _is_harmless(pair: str) -> bool:
    key, _, value = pair.partition("=")
    return bool(value) and key.lower() in _HARMLESS
