"""Whose fault it is: what a component's code raises becomes one message that names its plugin."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from tactile_core.errors import PluginFault, TactileError, words_of

_OF_THE_MACHINE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EMFILE, errno.ENFILE}
"""A full disk or table of files is no fault of the code that meets it."""


@contextmanager
def blame(part: str, component: object) -> Iterator[None]:
    """Let what a component's code raises inside the block become one message that names it.

    Errors that are raised on purpose (:class:`~tactile_core.errors.TactileError`), the user's
    interrupt and a full disk pass; so does what the core's own code raises, with a note that names
    the part. Everything else, an exit and an end of file too, becomes a fault of the plugin.

    Parameters
    ----------
    part : str
        What the component is here: ``"step 'height'"``, ``"the camera"``.
    component : object
        The component or its class.

    Raises
    ------
    PluginFault
        From what the plugin's code raised.
    """
    try:
        yield
    except GeneratorExit:
        raise
    except BaseException as error:
        from tactile_core.plugins.registry import origin_of

        cls = component if isinstance(component, type) else type(component)
        passes = isinstance(error, TactileError | KeyboardInterrupt) or (
            isinstance(error, OSError) and error.errno in _OF_THE_MACHINE
        )
        if passes or (isinstance(error, Exception) and origin_of(cls).is_core):
            error.add_note(f"raised by {part} ({origin_of(cls)})")
            raise
        raise fault(part, cls, f"failed: {words_of(error)}") from error


def fault(part: str, component: object, what: str) -> PluginFault:
    """Say that a component did something that its interface does not allow.

    Parameters
    ----------
    part, component
        As for :func:`blame`.
    what : str
        In words that follow the component's name.
    """
    from tactile_core.plugins.registry import origin_of

    origin = origin_of(component if isinstance(component, type) else type(component))
    whose = "tactile-core, so please report it" if origin.is_core else "that plugin"
    return PluginFault(f"{part} ({origin}) {what}; this is a fault of {whose}")


def blame_of(quantity: object) -> AbstractContextManager[None]:
    """:func:`blame` for the code of a quantity's class."""
    return blame(f"the quantity {type(quantity).__name__}", quantity)
