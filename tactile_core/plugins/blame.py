"""Converts exceptions of a component's code to one message that names its plugin."""

from __future__ import annotations

import errno
from contextlib import AbstractContextManager
from types import TracebackType

from tactile_core.errors import PluginFault, TactileError, words_of

# Error codes of a full disk or file table.
_OF_THE_MACHINE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EMFILE, errno.ENFILE}


def is_of_the_machine(error: BaseException) -> bool:
    """Whether a disk or a table of open files is full, which is no fault of a component."""
    return isinstance(error, OSError) and error.errno in _OF_THE_MACHINE


class _Blame:
    """The context manager of :func:`blame`, entered for every step of every frame."""

    __slots__ = ("_component", "_part")

    def __init__(self, part: str, component: object) -> None:
        self._part, self._component = part, component

    def __enter__(self) -> None:
        return None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            return
        from tactile_core.plugins.registry import origin_of

        part, component = self._part, self._component
        passes = isinstance(error, TactileError | KeyboardInterrupt) or is_of_the_machine(error)
        if passes or (isinstance(error, Exception) and origin_of(component).is_core):
            error.add_note(f"raised by {part} ({origin_of(component)})")
            return
        raise fault(part, component, f"failed: {words_of(error)}") from error


def blame(part: str, component: object) -> AbstractContextManager[None]:
    """Convert exceptions of a component's code inside the block to an error that names it.

    Errors raised on purpose (:class:`~tactile_core.errors.TactileError`), the user's interrupt, a
    full disk and exceptions of the core's own code pass unchanged, with a note that names the
    part. Everything else, including ``SystemExit`` and ``EOFError``, becomes a fault of the
    plugin.

    Parameters
    ----------
    part : str
        Role of the component: ``"step 'height'"``, ``"the camera"``.
    component : object
        The component, its class, or the function of a command.

    Raises
    ------
    PluginFault
        The plugin's code raised an exception.
    """
    return _Blame(part, component)


def fault(part: str, component: object, what: str) -> PluginFault:
    """Make the error for a component that violates its interface.

    Parameters
    ----------
    part, component
        See :func:`blame`.
    what : str
        The violation, as a predicate that follows the component's name.
    """
    from tactile_core.plugins.registry import origin_of

    origin = origin_of(component)
    whose = "tactile-core, so please report it" if origin.is_core else "that plugin"
    return PluginFault(f"{part} ({origin}) {what}; this is a fault of {whose}")


def blame_of(quantity: object) -> AbstractContextManager[None]:
    """Return :func:`blame` for the code of a quantity's class."""
    return blame(f"the quantity {type(quantity).__name__}", quantity)
