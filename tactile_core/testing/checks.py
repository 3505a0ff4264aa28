"""What makes a method a check: the things it is repeated for, and strict expected failures."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

import pytest

from tactile_core.interfaces.camera import Camera
from tactile_core.quantities import Quantity
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.registered import Registered

if TYPE_CHECKING:
    from tactile_core.testing.virtual_presses import VirtualPress

F = TypeVar("F", bound=Callable[..., None])
Subjects = Callable[[Registered], Sequence[object]]

PREFIX = "test_"


class Suite:
    """What a lab says of its plugin; the checks are in subclasses.

    Attributes
    ----------
    plugin : str
        The plugin's name.
    expected_failures : mapping of str to str
        A check's name, ``"units"`` or ``"units[estimator mylab.depth]"``, and why it fails.
    options : mapping of str to mapping
        Options under which a component works here: ``{"mylab.camera": {"port": "loop"}}``. Those
        of the plugin's profiles, else the defaults, serve where there are none.
    """

    plugin: ClassVar[str] = ""
    expected_failures: ClassVar[Mapping[str, str]] = {}
    options: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    registered: ClassVar[Registered]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.registered = Registered(cls.plugin, cls.options)

    def stall(self, camera: Camera) -> bool:
        """Make an open camera deliver nothing; return False, as here, where that cannot be done."""
        return False

    def inputs(self, scene: VirtualPress) -> Mapping[type[Quantity], Quantity]:
        """Return what an estimator needs of this scene and the kit cannot make by itself."""
        return {}


def check(subjects: Subjects | None = None) -> Callable[[F], F]:
    """Make a method a check, repeated for each subject: ``@check(Bench.cameras)``."""

    def made(method: F) -> F:
        name = method.__name__.removeprefix(PREFIX)

        @wraps(method)
        def judged(self: Suite, **subject: object) -> None:
            __tracebackhide__ = True
            full_name = "".join([name, *(f"[{one}]" for one in subject.values())])
            key = full_name if full_name in self.expected_failures else name
            reason = self.expected_failures.get(key)
            try:
                method(self, **subject)
            except Unjudged as why:
                pytest.skip(str(why))
            except Exception as error:
                if reason is not None:
                    pytest.xfail(reason)
                if isinstance(error, Fault) and error.__cause__ is None:
                    pytest.fail(str(error), pytrace=False)
                raise
            if reason is not None:
                pytest.fail(
                    f"{full_name} passes, and expected_failures says that it does not "
                    f"({reason})\n  Why it matters: a fault that comes back would go unnoticed\n"
                    f"  What to do: remove {key!r} from expected_failures, or name there only the "
                    f"component that still fails",
                    pytrace=False,
                )

        judged.__dict__["subjects"] = subjects
        return cast(F, judged)

    return made


def checks_of(suite: type[Suite]) -> dict[str, Callable[..., None]]:
    """Return each check of a suite by its name."""
    return {
        name.removeprefix(PREFIX): method
        for name, method in inspect.getmembers(suite, inspect.isfunction)
        if name.startswith(PREFIX)
    }


def subjects_of(
    method: Callable[..., None], registered: Registered
) -> tuple[str, list[object]] | None:
    """Return a check's argument and what it is repeated for; None for one of the whole plugin."""
    subjects: Subjects | None = getattr(method, "subjects", None)
    if subjects is None:
        return None
    argument = list(inspect.signature(method).parameters)[-1]
    return argument, list(subjects(registered))
