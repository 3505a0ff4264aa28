"""One plugin: imports its module, validates its hooks and looks up its components."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from inspect import CO_ASYNC_GENERATOR, CO_COROUTINE, CO_GENERATOR, signature
from pathlib import Path
from threading import Lock
from types import FunctionType
from typing import Any, Literal, NoReturn, Self, TypeVar, get_args

from pluggy import HookImpl, PluginManager, PluginValidationError

from tactile_core.errors import PluginError, words_of
from tactile_core.interfaces import hookspecs
from tactile_core.plugins.entry_points import Offer, opencv_fault_behind

ComponentKind = Literal[
    "camera",
    "illumination",
    "light_driver",
    "calibrator",
    "artefact",
    "estimator",
    "sink",
    "recording_format",
    "simulator",
    "importer",
    "cluster",
]
KINDS: tuple[ComponentKind, ...] = get_args(ComponentKind)

_HOOKS: Mapping[ComponentKind, str] = {kind: f"tactile_{kind}s" for kind in KINDS}
_COMMANDS = "tactile_commands"
_ALL_HOOKS = (*_HOOKS.values(), _COMMANDS, "tactile_profiles")
_REGISTERING = Lock()
_COMPONENT_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_COMMAND_NAME = re.compile(r"[a-z][a-z0-9-]*")

T = TypeVar("T")


@dataclass(frozen=True)
class Report:
    """What a plugin registers, and the problems with it."""

    components: Mapping[ComponentKind, tuple[str, ...]]
    commands: tuple[str, ...]
    profiles: Path | None
    problems: tuple[str, ...]


@dataclass(frozen=True)
class Plugin:
    """An imported plugin with valid hooks."""

    offer: Offer
    _hooks: Mapping[str, HookImpl]

    @classmethod
    def load(cls, offer: Offer) -> Self:
        """Import the plugin and validate its hooks.

        Raises
        ------
        PluginError
            It cannot be imported, or implements unknown hooks.
        """
        found = _attempt(partial(_object, offer.value), f"{offer} cannot be imported", offer)
        try:
            hooks = _register_plugin(found)
        except PluginValidationError as error:
            raise PluginError(
                f"{offer} has an invalid hook ({words_of(error)}); {_remedy(offer)}"
            ) from error
        unknown = [
            name
            for name, implementation in hooks.items()
            if name not in _ALL_HOOKS and not implementation.optionalhook
        ]
        if unknown:
            raise PluginError(
                f"{offer} implements {unknown[0]}, which is not a hook of {offer.group}"
                f"{_instead(unknown[0], _ALL_HOOKS)}"
            )
        for name in _ALL_HOOKS:
            if name not in hooks and callable(getattr(found, name, None)):
                raise PluginError(
                    f"{offer}: decorate {name} with @hookimpl of tactile_core.interfaces.hookspecs"
                )
        return cls(offer, hooks)

    def components(self, kind: ComponentKind) -> Mapping[str, str]:
        """Return ``{name: "module:Class"}`` of one kind; empty if the plugin has none.

        Raises
        ------
        PluginError
            The hook fails or returns a value of the wrong form.
        """
        form = "{name: 'module:Class'} with names of letters, digits and '_'"
        return self._registered(_HOOKS[kind], _COMPONENT_NAME, form)

    def commands(self) -> Mapping[str, str]:
        """Return ``{name: "module:function"}`` of its commands; empty if it has none.

        Raises
        ------
        PluginError
            The hook fails or returns a value of the wrong form.
        """
        form = "{name: 'module:function'} with names of small letters, digits and '-'"
        return self._registered(_COMMANDS, _COMMAND_NAME, form)

    def command(self, name: str) -> Callable[..., None]:
        """Import one of its commands.

        Raises
        ------
        PluginError
            It cannot be imported, or is not a function that can be called with named arguments.
        """
        value = self.commands()[name]
        what = f"{self.offer}: the command {name} ({value})"
        found = _attempt(partial(_object, value), f"{what} cannot be imported", self.offer)
        fault = _fault_of_command(found)
        if fault:
            raise PluginError(f"{what} {fault}; {_remedy(self.offer)}")
        function: Callable[..., None] = found
        return function

    def _registered(
        self, hook: str, name_form: re.Pattern[str], in_words: str
    ) -> Mapping[str, str]:
        registered = self._call(hook)
        if registered is None:
            return {}
        if not isinstance(registered, Mapping) or not all(
            isinstance(value, str) and isinstance(name, str) and name_form.fullmatch(name)
            for name, value in registered.items()
        ):
            raise PluginError(f"{self.offer}: {hook} must return {in_words}, not {registered!r}")
        return registered

    def component(self, kind: ComponentKind, name: str) -> type:
        """Import one component and return its class.

        Raises
        ------
        PluginError
            There is no such component, or it is not a class that implements the interface.
        """
        registered = self.components(kind)
        if name not in registered:
            self._refuse(kind, name, registered)
        value = registered[name]
        what = f"{self.offer}: {kind_in_words(kind)} {self.offer.name}.{name} ({value})"
        interface = _interface(kind)
        found = _attempt(partial(_object, value), f"{what} cannot be imported", self.offer)
        if not isinstance(found, type) or not issubclass(found, interface):
            raise PluginError(
                f"{what} is not a subclass of tactile_core.{interface.__name__}; "
                f"{_remedy(self.offer)}"
            )
        unwritten = sorted(getattr(found, "__abstractmethods__", ()))
        if unwritten:
            raise PluginError(
                f"{what} does not define {', '.join(unwritten)}; {_remedy(self.offer)}"
            )
        return found

    def profile_directory(self) -> Path | None:
        """Return the folder of the plugin's profiles, or None.

        Raises
        ------
        PluginError
            The hook fails or does not return a folder.
        """
        given = self._call("tactile_profiles")
        if given is None:
            return None
        if not isinstance(given, str | Path) or not Path(given).is_dir():
            raise PluginError(
                f"{self.offer}: tactile_profiles must return an existing folder, not {given!r}"
            )
        return Path(given)

    def report(self, *, import_components: bool) -> Report:
        """Return what the plugin registers; collect problems instead of raising them."""
        problems: list[str] = []
        components: dict[ComponentKind, tuple[str, ...]] = {}
        for kind in KINDS:
            names = tuple(_collect(partial(self.components, kind), problems) or ())
            if names:
                components[kind] = names
            if import_components:
                for name in names:
                    _collect(partial(self.component, kind, name), problems)
        commands = tuple(_collect(self.commands, problems) or ())
        if import_components:
            for name in commands:
                _collect(partial(self.command, name), problems)
        profiles = _collect(self.profile_directory, problems)
        if not (problems or components or commands or profiles):
            problems.append(f"{self.offer} registers no component, no command and no profile")
        return Report(components, commands, profiles, tuple(problems))

    def _call(self, hook: str) -> Any:
        if hook not in self._hooks:
            return None
        implementation = self._hooks[hook].function
        return _attempt(implementation, f"{self.offer}: {hook} failed", self.offer)

    def _refuse(self, kind: ComponentKind, name: str, registered: Mapping[str, str]) -> NoReturn:
        for other in KINDS:
            if other != kind and name in (_collect(partial(self.components, other), []) or ()):
                raise PluginError(
                    f"{self.offer.name}.{name} of {self.offer.origin} is of the kind "
                    f"{kind_in_words(other)}, not {kind_in_words(kind)}; name another component"
                )
        raise PluginError(
            f"{self.offer} has no {kind_in_words(kind)} {name!r}{_instead(name, tuple(registered))}"
        )


@cache
def _manager() -> PluginManager:
    manager = PluginManager("tactile_core")
    manager.add_hookspecs(hookspecs)
    return manager


def _register_plugin(plugin: Any) -> dict[str, HookImpl]:
    """Return a plugin's implementations by hook; validate them on first use."""
    manager = _manager()
    with _REGISTERING:
        if not manager.is_registered(plugin):
            try:
                # by identity: names are not unique, and one object can have two names
                manager.register(plugin, str(id(plugin)))
            except PluginValidationError:
                if manager.is_registered(plugin):
                    manager.unregister(plugin)
                raise
        return {
            hook.name: implementation
            for hook in manager.get_hookcallers(plugin) or ()
            for implementation in hook.get_hookimpls()
            if implementation.plugin is plugin
        }


def _object(value: str) -> Any:
    module, colon, attribute = (part.strip() for part in value.partition(":"))
    if not module or (colon and not attribute):
        raise ValueError(f"{value!r} is not of the form 'module:name'")
    found: Any = import_module(module)
    for part in attribute.split(".") if attribute else ():
        found = getattr(found, part)
    return found


def _fault_of_command(found: object) -> str:
    """Return why an object cannot be a command, as a predicate; empty if it can be."""
    if not isinstance(found, FunctionType):
        return "is not a function"
    if found.__code__.co_flags & (CO_COROUTINE | CO_GENERATOR | CO_ASYNC_GENERATOR):
        return "does nothing when it is called, because it has 'async' or 'yield'"
    for one in signature(found).parameters.values():
        if one.kind not in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY):
            return f"has the parameter {one.name!r}, to which nothing can be passed by name"
    return ""


def _interface(kind: ComponentKind) -> type:
    name = "".join(word.capitalize() for word in kind.split("_"))
    module = "calibration" if kind == "calibrator" else kind
    interface: type = getattr(import_module(f"tactile_core.interfaces.{module}"), name)
    return interface


def kind_in_words(kind: ComponentKind) -> str:
    """Return the name of a kind of component in messages."""
    return kind.replace("_", " ")


def _attempt(action: Callable[[], T], what: str, offer: Offer) -> T:
    """Run a plugin's code; no exception, not even SystemExit, may end the host program."""
    try:
        return action()
    except (Exception, SystemExit) as error:
        remedy = opencv_fault_behind(error) or _remedy(offer)
        raise PluginError(f"{what} ({words_of(error)}); {remedy}") from error


def _collect(action: Callable[[], T], problems: list[str]) -> T | None:
    try:
        return action()
    except PluginError as error:
        problems.append(str(error))
        return None


def _instead(name: str, known: tuple[str, ...]) -> str:
    from difflib import get_close_matches

    near = get_close_matches(name, known, n=1)
    if near:
        return f"; did you mean {near[0]!r}?"
    return f"; it has {', '.join(sorted(known)) or 'none'}"


def _remedy(offer: Offer) -> str:
    return f"repair or update {offer.distribution}"
