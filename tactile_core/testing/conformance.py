"""The conformance kit, and what a plugin registers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from pydantic import BaseModel, ValidationError

from tactile_core.algorithms.arrays.types import parts
from tactile_core.errors import PluginError
from tactile_core.interfaces.device import Device
from tactile_core.plugins.plugin import KINDS, ComponentKind
from tactile_core.plugins.registry import find_plugin, resolve
from tactile_core.testing.calibrations import CalibrationChecks
from tactile_core.testing.cameras import CameraChecks
from tactile_core.testing.checks import PREFIX, Suite, check, checks_of, subjects_of
from tactile_core.testing.commands import CommandChecks
from tactile_core.testing.devices import DeviceChecks, SinkChecks
from tactile_core.testing.differences import Fault, report, report_errors
from tactile_core.testing.estimators import EstimatorChecks
from tactile_core.testing.illuminations import IlluminationChecks, LightDriverChecks
from tactile_core.testing.imports import Footprint, ImportChecks
from tactile_core.testing.profiles import ProfileChecks
from tactile_core.testing.recording_formats import RecordingFormatChecks
from tactile_core.testing.registered import Part
from tactile_core.testing.simulators import SimulatorChecks

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")  # Valid names of plugins in profiles

_UNKNOWN = "no_such_option"  # Name of an option that no component has


# Kinds of components that are constructed from options.
CONSTRUCTIBLE: tuple[ComponentKind, ...] = tuple(
    kind
    for kind in KINDS
    if kind not in ("artefact", "cluster", "importer", "recording_format", "simulator")
)


class RegistrationChecks(Suite):
    """The hooks' return values and the classes that they name."""

    @check()
    def test_registration(self) -> None:
        """The plugin can be imported, no other has its name, and it registers something."""
        try:
            problems = find_plugin(self.plugin).report(import_components=False).problems
        except PluginError as error:
            problems = (str(error),)
        if not _NAME.fullmatch(self.plugin):
            problems = (*problems, "its name is not valid in front of the dot of 'use:'")
        report(
            f"plugin {self.plugin!r}",
            "; ".join(problems),
            why="only what is registered can be used",
            do="see hookspecs.py: a hook takes no arguments and returns {name: "
            "'module:Class'}; tactile_profiles returns an existing folder",
        )

    @check(*KINDS)
    def test_components(self, part: Part) -> None:
        """Each name refers to a class that implements the interface of its hook."""
        with report_errors(
            part,
            "it cannot be used",
            why="profiles and commands that use it fail",
            do="correct the hook's 'module:Class', or the class",
        ):
            resolve(part.kind, part.use)

    @check(*CONSTRUCTIBLE)
    def test_options(self, part: Part) -> None:
        """Options are frozen, refuse unknown keys, and each has a description."""
        for model in _models(self.registered.class_of(part).Options):
            report(
                f"{part}: {model.__name__}",
                _fault_of_options(model),
                why="a misspelt or a changed option would be silently ignored, and the description "
                "is the documentation for authors of profiles",
                do="derive it from tactile_core.interfaces.device.Options, and write "
                "Field(default=…, description=…); an option without default is required",
            )

    @check(*CONSTRUCTIBLE)
    def test_construction(self, part: Part) -> None:
        """A component can be constructed from its options; a device does not open itself then."""
        before = Footprint.take_snapshot()
        with report_errors(
            part,
            "it cannot be constructed",
            why="no other check can run, and profiles that use it are refused",
            do=f"set options that work here in the test class: options = {{{part.use!r}: {{…}}}}",
        ):
            made = self.registered.make(part)
        left = before.find_leaks() if isinstance(made, Device) else ""
        report(
            part,
            left and f"its constructor leaves {left}",
            why="a device that is constructed but not opened is never closed",
            do="access the hardware only in _open",
        )


def _fault_of_options(model: type[BaseModel]) -> str:
    try:
        model.model_validate({_UNKNOWN: 1})
        errors: list[Any] = []
    except ValidationError as error:
        errors = list(error.errors())
    if not any(e["type"] == "extra_forbidden" and e["loc"] == (_UNKNOWN,) for e in errors):
        return "it accepts unknown keys"
    if not model.model_config.get("frozen"):
        return "its values can be changed after validation"
    bare = [name for name, field in model.model_fields.items() if not field.description]
    return f"{', '.join(bare)}: no description" if bare else ""


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models in an annotation and in their fields."""
    for member in parts(annotation).members:
        if isinstance(member, type) and issubclass(member, BaseModel):
            yield member
            for field in member.model_fields.values():
                yield from _models(field.annotation)
        for argument in get_args(member):
            yield from _models(argument)


class PluginConformance(
    RegistrationChecks,
    ImportChecks,
    DeviceChecks,
    CameraChecks,
    IlluminationChecks,
    LightDriverChecks,
    CalibrationChecks,
    EstimatorChecks,
    SinkChecks,
    RecordingFormatChecks,
    SimulatorChecks,
    CommandChecks,
    ProfileChecks,
):
    """Checks everything that a plugin registers; see docs/how-to/test-a-plugin.md.

    Subclass it in a test module and set ``plugin``, and ``expected_failures`` and ``options`` if
    you need them.
    """

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Repeat each check for each of its subjects."""
        found = subjects_of(metafunc.function, self.registered)
        if found is None:
            return
        argument, subjects = found
        params = [pytest.param(subject, id=str(subject)) for subject in subjects]
        if not params:
            nothing = f"plugin {self.plugin!r} registers nothing for this check"
            params = [pytest.param(None, id="none", marks=pytest.mark.skip(reason=nothing))]
        metafunc.parametrize(argument, params)

    def test_expected_failures(self) -> None:
        """``expected_failures`` names existing checks and components."""
        known = set[str]()
        for name, method in checks_of(type(self)).items():
            found = subjects_of(method, self.registered)
            known |= {name} | {f"{name}[{subject}]" for subject in (found[1] if found else ())}
        for key in self.expected_failures:
            if key not in known:
                fault = Fault(
                    type(self).__name__,
                    f"expected_failures names {key!r}, which is not a check of this plugin",
                    why="the entry has no effect",
                    do=f"remove it, or use a name from pytest's output without {PREFIX!r}",
                )
                pytest.fail(str(fault), pytrace=False)
