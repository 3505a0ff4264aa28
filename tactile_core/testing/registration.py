"""Checks of what a plugin registers: names, classes, options."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from tactile_core import __version__
from tactile_core.errors import PluginError
from tactile_core.interfaces.device import Device
from tactile_core.interfaces.hookspecs import GROUP
from tactile_core.plugins.entry_points import installed_offers, normalized
from tactile_core.plugins.registry import find_plugin, resolve
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.footprint import Footprint
from tactile_core.testing.registered import Part, Registered

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
_UNKNOWN = "no_such_option"


class RegistrationChecks(Suite):
    """What the hooks say, and the classes that they name."""

    @check()
    def test_registration(self) -> None:
        """The plugin imports, its hooks return what they must, and there is something in it."""
        if len(self._claimants()) > 1:
            raise Unjudged("see the check 'collision'")
        try:
            problems = find_plugin(self.plugin).report(import_components=False).problems
        except PluginError as error:
            problems = (str(error),)
        if problems:
            raise Fault(
                f"plugin {self.plugin!r}",
                "; ".join(problems),
                why="no profile can name anything of a plugin that does not register it",
                do="see hookspecs.py: a hook takes nothing and returns {name: 'module:Class'}, "
                "and tactile_profiles an existing folder",
            )

    @check()
    def test_collision(self) -> None:
        """No other distribution offers a plugin of this name."""
        claimants = self._claimants()
        if len(claimants) > 1:
            origins = [f"{name} {version}" for name, version in claimants.items()]
            raise Fault(
                f"plugin {self.plugin!r}",
                f"it is offered by {' and by '.join(sorted(origins))}",
                why="the core refuses both rather than guess which one a profile means",
                do="uninstall one of them, or rename your entry point",
            )

    @check()
    def test_names(self) -> None:
        """The plugin's name can be written in a profile."""
        if not _NAME.fullmatch(self.plugin):
            raise Fault(
                f"plugin {self.plugin!r}",
                "its name cannot be written before the dot of 'use: plugin.name'",
                why="no profile can name its components",
                do="name the entry point with letters, digits, '_' and '-', a letter first",
            )

    @check(Registered.parts)
    def test_components(self, part: Part) -> None:
        """Each name leads to a class that implements the interface of its hook."""
        try:
            resolve(part.kind, part.use)
        except PluginError as error:
            raise Fault(
                part,
                str(error),
                why="naming it in a profile fails",
                do="correct the hook's 'module:Class', or the class",
            ) from error

    @check(Registered.makeable)
    def test_options(self, part: Part) -> None:
        """Options are frozen, refuse unknown keys, and each has a description."""
        options = self.registered.class_of(part).Options
        for model in _models(options):
            self._judge_options(part, model)

    @check(Registered.makeable)
    def test_construction(self, part: Part) -> None:
        """A component is made from its options, and a device does not open in its constructor."""
        before = Footprint.now()
        try:
            made = self.registered.make(part)
        except Unjudged:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"it cannot be made ({type(error).__name__}: {error})",
                why="nothing else can be tried, and a profile that names it is refused",
                do="give options that work here, in the test class: "
                f"options = {{{part.use!r}: {{…}}}}",
            ) from error
        left = before.left() if isinstance(made, Device) else ""
        if left:
            raise Fault(
                part,
                f"its constructor leaves {left}",
                why="devices are made to ask for their channels, and nobody closes those",
                do="touch hardware in _open alone",
            )

    def _claimants(self) -> dict[str, str]:
        """Each distribution that offers a plugin of this name, and its version."""
        offers = [o for o in installed_offers() if (o.name, o.group) == (self.plugin, GROUP)]
        core = {"tactile-core": __version__} if self.plugin == "core" else {}
        return core | {normalized(offer.distribution): offer.version for offer in offers}

    def _judge_options(self, part: Part, model: type[BaseModel]) -> None:
        where = f"{part}: {model.__name__}"
        try:
            model.model_validate({_UNKNOWN: 1})
            errors: list[Any] = []
        except ValidationError as error:
            errors = list(error.errors())
        if not any(e["type"] == "extra_forbidden" and e["loc"] == (_UNKNOWN,) for e in errors):
            raise Fault(
                where,
                "it accepts a key that it does not know",
                why="a misspelt option in a profile would be ignored in silence",
                do="derive it from tactile_core.interfaces.device.Options, or set extra='forbid'",
            )
        if not model.model_config.get("frozen"):
            raise Fault(
                where,
                "its values can be changed after validation",
                why="a component may then work with other options than the profile says",
                do="derive it from tactile_core.interfaces.device.Options, or set frozen=True",
            )
        bare = [name for name, field in model.model_fields.items() if not field.description]
        if bare:
            raise Fault(
                where,
                f"{', '.join(bare)}: no description",
                why="whoever writes a profile has nothing but this sentence",
                do="write Field(default=…, description=…); without a default it is required",
            )


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models in an annotation, and those in their fields."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            yield from _models(field.annotation)
    for argument in get_args(annotation):
        yield from _models(argument)
