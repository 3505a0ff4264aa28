"""What a check says when it does not pass."""

from __future__ import annotations


class Fault(AssertionError):
    """Something that a plugin does wrong, told like advice.

    Parameters
    ----------
    where : object
        The component or profile, as its name.
    found : str
        What was seen.
    why : str
        What goes wrong for whoever uses the plugin.
    do : str
        How it is put right.
    """

    def __init__(self, where: object, found: str, *, why: str, do: str) -> None:
        super().__init__(f"{where}: {found}\n  Why it matters: {why}\n  What to do: {do}")


class Unjudged(Exception):
    """A check cannot be carried out, because what it looks at is missing or failed another one."""
