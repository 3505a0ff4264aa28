"""The exceptions of checks."""

from __future__ import annotations


class Fault(AssertionError):
    """A fault of a plugin, reported with its consequence and a remedy.

    Parameters
    ----------
    where : object
        The component or profile; its string is its name.
    found : str
        The observed fault.
    why : str
        The consequence for users of the plugin.
    do : str
        How to fix it.
    """

    def __init__(self, where: object, found: str, *, why: str, do: str) -> None:
        super().__init__(f"{where}: {found}\n  Why it matters: {why}\n  What to do: {do}")


class CannotCheck(Exception):
    """A check cannot run, because its subject is missing or failed another check."""
