"""Refuses words of a command line that can never be valid, such as overlong names."""

from __future__ import annotations

import os
from collections.abc import Sequence

from tactile_core.errors import InputError
from tactile_core.formats.printable import printable

LONGEST_NAME = 255  # Longest file name that file systems accept, bytes


def refuse_impossible(words: Sequence[str]) -> None:
    """Refuse empty words, which would mean the current folder, and overlong file names.

    Raises
    ------
    InputError
        A word is empty or too long; the message names the option in front of it.
    """
    for before, word in zip(("", *words), words, strict=False):
        option, equals, value = word.partition("=") if word.startswith("--") else (before, "", word)
        where = option if option.startswith("--") else "an argument"
        if not value and (equals or not word):
            raise InputError(f"{where} is empty; give a value, or leave it out")
        longest = max(value.split("/"), key=len)
        if len(os.fsencode(longest)) > LONGEST_NAME:
            raise InputError(
                f"{where}: the name {printable(longest[:40])}… is longer than the "
                f"{LONGEST_NAME} bytes that a file's name can have; shorten it"
            )
