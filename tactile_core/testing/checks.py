"""The decorator for checks: repeats one per component and handles expected failures."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

import pytest

from tactile_core.interfaces.camera import Camera
from tactile_core.quantities import Quantity
from tactile_core.testing.differences import CannotCheck, Fault
from tactile_core.testing.registered import Registered, SubjectKind

if TYPE_CHECKING:
    from tactile_core.testing.virtual_presses import VirtualPress

F = TypeVar("F", bound=Callable[..., None])

PREFIX = "test_"  # Prefix of check methods; the rest of the method's name is the name of the check


class Suite:
    """The settings of a plugin's test class; subclasses add the checks.

    Attributes
    ----------
    plugin : str
        The plugin's name.
    expected_failures : mapping of str to str
        Reason by name of a check, ``"units"`` or ``"units[estimator mylab.depth]"``.
    options : mapping of str to mapping
        Options for a component in tests: ``{"mylab.camera": {"port": "loop"}}``. Default: the
        options in the plugin's profiles, else the defaults of the component.
    """

    plugin: ClassVar[str] = ""
    expected_failures: ClassVar[Mapping[str, str]] = {}
    options: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    registered: ClassVar[Registered]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.registered = Registered(cls.plugin, cls.options)

    def stall(self, camera: Camera) -> bool:
        """Make an open camera deliver nothing; return False, the default, if that is impossible."""
        return False

    def inputs(self, scene: VirtualPress) -> Mapping[type[Quantity], Quantity]:
        """Return the quantities of a scene that an estimator needs and the kit cannot compute."""
        return {}


def check(*kinds: SubjectKind) -> Callable[[F], F]:
    """Make a method a check, repeated for each subject of some kinds: ``@check("camera")``."""

    def made(method: F) -> F:
        name = method.__name__.removeprefix(PREFIX)

        @wraps(method)
        def checked(self: Suite, **subject: object) -> None:
            __tracebackhide__ = True
            full_name = "".join([name, *(f"[{one}]" for one in subject.values())])
            key = full_name if full_name in self.expected_failures else name
            reason = self.expected_failures.get(key)
            try:
                method(self, **subject)
            except CannotCheck as why:
                pytest.skip(str(why))
            except Exception as error:
                if reason is not None:
                    pytest.xfail(reason)
                if isinstance(error, Fault) and error.__cause__ is None:
                    pytest.fail(str(error), pytrace=False)
                raise
            if reason is not None:
                pytest.fail(
                    f"{full_name} passes, but expected_failures lists it as failing "
                    f"({reason})\n  Why it matters: the fault could return unnoticed\n"
                    f"  What to do: remove {key!r} from expected_failures, or list only the "
                    f"component that still fails",
                    pytrace=False,
                )

        checked.__dict__["kinds"] = kinds
        return cast(F, checked)

    return made


def checks_of(suite: type[Suite]) -> dict[str, Callable[..., None]]:
    """Return the checks of a suite by name."""
    return {
        name.removeprefix(PREFIX): method
        for name, method in inspect.getmembers(suite, inspect.isfunction)
        if name.startswith(PREFIX)
    }


def subjects_of(
    method: Callable[..., None], registered: Registered
) -> tuple[str, list[object]] | None:
    """Return a check's argument and its subjects; None for a check of the whole plugin."""
    kinds: tuple[SubjectKind, ...] = getattr(method, "kinds", ())
    if not kinds:
        return None
    argument = list(inspect.signature(method).parameters)[-1]
    return argument, registered.subjects(*kinds)
