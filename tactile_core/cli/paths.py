"""What no word of a command line may be, whatever it stands for."""

from __future__ import annotations

import os
from collections.abc import Sequence

from tactile_core.errors import InputError
from tactile_core.formats.printable import printable

LONGEST_NAME = 255
"""Bytes of one name that file systems take."""


def refuse_impossible(words: Sequence[str]) -> None:
    """Refuse empty words, which would mean the folder here, and names that no file can have.

    Raises
    ------
    InputError
        With the option that the word follows.
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
