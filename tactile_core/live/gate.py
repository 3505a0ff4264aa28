"""Decides who may see and command a page: by token, host and origin."""

from __future__ import annotations

import ipaddress
import os
import re
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tactile_core.errors import InputError

_TOKEN_BYTES = 32
_TOKEN = re.compile(r"[A-Za-z0-9_-]{43}")


@dataclass(frozen=True)
class Gate:
    """Lets requests in that know the token and come from the page itself.

    Browsers name the page that a request comes from (``Origin``) and the host that its user
    believes to speak with (``Host``). A foreign page cannot forge either: checked together, they
    keep out other sites, and those whose name was pointed to this machine (DNS rebinding).

    Attributes
    ----------
    token : str
        First part of every path.
    hosts : frozenset of str
        Values of ``Host`` that are this server.
    """

    token: str
    hosts: frozenset[str]

    @classmethod
    def at(cls, token: str, port: int, names: Iterable[str]) -> Gate:
        """Make the gate of a server on a port, by the names and addresses that lead to it."""
        shown = [f"[{name}]" if ":" in name else name for name in names]
        hosts = {f"{name}:{port}".lower() for name in shown}
        return cls(token, frozenset(hosts | {name.lower() for name in shown if port == 80}))

    def refusal(self, path: str, host: str | None, origin: str | None) -> str:
        """Return why a request is refused, in one sentence; empty if it may come in."""
        if host is None or host.lower() not in self.hosts:
            return "This server is not the host that was asked for; open the printed address."
        if origin is not None and origin.lower() not in {f"http://{name}" for name in self.hosts}:
            return "Another site may not use this server."
        given = path.split("/")[1] if path.startswith("/") else ""
        # compare_digest takes the same time wherever the first wrong letter is
        if not secrets.compare_digest(given.encode(), self.token.encode()):
            return "The address has no valid token; open it as 'tactile view' printed it."
        return ""

    def inside(self, path: str) -> str:
        """Return the path behind the token."""
        return path.partition("?")[0].split("/", 2)[2] if path.count("/") > 1 else ""


def own_token(folder: Path) -> str:
    """Return this user's token, made once, so that a page finds a restarted server again.

    It is kept in a file that only the user can read.

    Raises
    ------
    OSError
        The file cannot be read or written.
    """
    path = folder / "live-page-token"
    try:
        token = path.read_text("ascii").strip()
    except (FileNotFoundError, UnicodeDecodeError):
        token = ""
    if not _TOKEN.fullmatch(token):
        token = secrets.token_urlsafe(_TOKEN_BYTES)
        folder.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(opened, "w", encoding="ascii") as file:
            file.write(token + "\n")
    return token


def names_of(host: str) -> list[str]:
    """Return the names that lead to a server which listens on an address.

    Raises
    ------
    InputError
        It listens on every address, so that its names are unknown.
    """
    if host == "localhost":
        return ["localhost", "127.0.0.1"]
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return [host]
    if address.is_unspecified:
        raise InputError(
            f"--host {host} is every address of this computer; name the one that the browser will "
            f"use, so that requests to another one can be refused"
        )
    return [host, "localhost"] if address.is_loopback else [host]
