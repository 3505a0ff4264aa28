"""The components and profiles of a plugin, constructed for testing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel

from tactile_core.acquisition.devices import make_lights
from tactile_core.errors import PluginError, TactileError
from tactile_core.interfaces.calibration import Calibration, Calibrator
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.device import Device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.plugins.entry_points import installed_offers
from tactile_core.plugins.plugin import ComponentKind, Plugin
from tactile_core.plugins.registry import find_plugin, resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.testing.differences import CannotCheck, depend_on
from tactile_core.testing.virtual_presses import Rig, full_rig, generic_rig, small_rig

SubjectKind = ComponentKind | Literal["command", "profile"]


@dataclass(frozen=True)
class Part:
    """A registered component: its kind, and its name in profiles."""

    kind: ComponentKind
    use: str

    def __str__(self) -> str:
        return f"{self.kind} {self.use}"


@dataclass(frozen=True)
class AddedCommand:
    """A command of ``tactile`` that the plugin adds."""

    name: str

    def __str__(self) -> str:
        return f"command {self.name}"


@dataclass(frozen=True)
class ProfileFile:
    """A profile of the plugin, or a shipped profile that uses the plugin."""

    path: Path

    def __str__(self) -> str:
        return f"profile {self.path.stem}"


class Registered:
    """The components of a plugin, constructed on demand.

    Parameters
    ----------
    plugin : str
    options : mapping of component to its options
    """

    def __init__(self, plugin: str, options: Mapping[str, Mapping[str, Any]]) -> None:
        self.name = plugin
        self._options = options
        self._rigs: dict[Part, Rig] = {}
        self._fits: dict[Part, Calibration | Exception] = {}

    @cached_property
    def plugin(self) -> Plugin | None:
        """The imported plugin; None if the import fails."""
        try:
            return find_plugin(self.name)
        except PluginError:
            return None

    def parts(self, kind: ComponentKind) -> list[Part]:
        """Return the components of a kind."""
        try:
            names = self.plugin.components(kind) if self.plugin is not None else ()
        except PluginError:
            return []
        return [Part(kind, f"{self.name}.{name}") for name in names]

    def subjects(self, *kinds: SubjectKind) -> list[object]:
        """Return the components of some kinds, the commands or the profiles."""
        found: list[object] = []
        for kind in kinds:
            if kind == "command":
                found += self.commands()
            else:
                found += self.profiles() if kind == "profile" else self.parts(kind)
        return found

    def commands(self) -> list[AddedCommand]:
        """Return the commands that the plugin adds."""
        try:
            return [*map(AddedCommand, self.plugin.commands() if self.plugin is not None else ())]
        except PluginError:
            return []

    def profiles(self) -> list[ProfileFile]:
        """Return the plugin's profiles, and the shipped ones that use it with what is installed."""
        import sensor_profiles

        own: Path | None = None
        with suppress(PluginError):
            own = self.plugin.profile_directory() if self.plugin is not None else None
        found = [] if own is None else sorted(own.glob("*.yaml"))
        shipped = sorted(sensor_profiles.DIRECTORY.glob("*.yaml"))
        return [ProfileFile(path) for path in found + [p for p in shipped if self._is_for(p)]]

    @cached_property
    def valid_profiles(self) -> list[Profile]:
        """Valid profiles that may use the components: the plugin's, or all shipped for the core."""
        import sensor_profiles

        paths = [file.path for file in self.profiles()]
        if self.name == "core":
            paths += sorted(set(sensor_profiles.DIRECTORY.glob("*.yaml")) - set(paths))
        valid = []
        for path in paths:
            with suppress(TactileError):
                valid.append(load_profile(path))
        return valid

    def class_of(self, part: Part) -> Any:
        """Return the component's class.

        Raises
        ------
        CannotCheck
            It cannot be imported.
        """
        with depend_on("components"):
            return resolve(part.kind, part.use)

    def function_of(self, command: AddedCommand) -> Callable[..., None]:
        """Return the function of a command.

        Raises
        ------
        PluginError
            It cannot be imported or called.
        """
        assert self.plugin is not None  # it registers the command
        return self.plugin.command(command.name)

    def options(self, part: Part) -> BaseModel:
        """Return the options for testing a component; raises pydantic's error if invalid."""
        options: type[BaseModel] = self.class_of(part).Options
        return options.model_validate(self._given_options(part))

    def make(self, part: Part, context: SensorContext | None = None) -> Any:
        """Construct a component; exceptions of its constructor pass through."""
        cls = self.class_of(part)
        if issubclass(cls, Camera):
            return cls.for_build(self.options(part), self.rig(part).profile)
        if not issubclass(cls, Estimator):
            return cls(self.options(part))
        return cls(self.options(part), context or self.rig(part).context)

    def make_or_skip(self, part: Part) -> Any:
        """Construct a component.

        Raises
        ------
        CannotCheck
            Its construction fails.
        """
        with depend_on("construction"):
            return self.make(part)

    def device(self, part: Part) -> Device:
        """Construct a device; a light driver is attached to its profile's camera.

        Raises
        ------
        CannotCheck
            Its construction fails.
        """
        device: Device = self.make_or_skip(part)
        if isinstance(device, LightDriver) and (camera := self._companion(part)) is not None:
            with depend_on("opening"):
                device.attach(camera)
        return device

    def exposures(self, part: Part) -> Sequence[Exposure]:
        """Return the exposures of a profile that uses the device; default: a dark exposure."""
        for profile in self.valid_profiles:
            if _uses(profile, part):
                with suppress(TactileError):
                    return make_lights(profile).exposures()
        return (Exposure({}, ()),)

    def rig(self, part: Part) -> Rig:
        """Return a virtual sensor like that of a profile that uses the component, if there is one.

        For an estimator it has the profile's image size, because network weights may need it, and
        its markers. For other components it is small and has no markers.
        """
        if part not in self._rigs:
            users = [p for p in self.valid_profiles if _uses(p, part)]
            if part.kind == "estimator":
                rigs = (full_rig(profile) for profile in users)
            else:
                rigs = (small_rig(profile) for profile in [*users, *self.valid_profiles])
            self._rigs[part] = next((rig for rig in rigs if rig is not None), generic_rig())
        return self._rigs[part]

    def fit(self, part: Part) -> Calibration:
        """Fit a calibration to virtual presses."""
        rig = self.rig(part)
        calibrator: Calibrator = self.make(part)
        return calibrator.fit(rig.presses, rig.reference)

    def fit_once(self, part: Part) -> Calibration:
        """Return the calibration that all checks share; it is fitted once.

        Raises
        ------
        CannotCheck
            The fit fails.
        """
        self.skip_refusing(part)
        if part not in self._fits:
            try:
                self._fits[part] = self.fit(part)
            except Exception as error:
                self._fits[part] = error
        fitted = self._fits[part]
        if not isinstance(fitted, Calibration):
            raise CannotCheck(f"see the check 'fit': {fitted}")
        return fitted

    def skip_refusing(self, part: Part) -> None:
        """Leave out the checks of a calibrator that never fits anything.

        Raises
        ------
        CannotCheck
            It is one.
        """
        if self.class_of(part).refusal:
            raise CannotCheck("its sensor measures no slopes, as it says itself")

    def _given_options(self, part: Part) -> Mapping[str, Any]:
        if part.use in self._options:
            return self._options[part.use]
        named = [c for p in self.valid_profiles for c in p.components.values()]
        return next((c.options for c in named if c.use == part.use), {})

    def _companion(self, part: Part) -> Camera | None:
        """Return the camera of a profile that uses this light driver, if it is the plugin's."""
        for profile in self.valid_profiles:
            camera = Part("camera", profile.camera.use)
            if _uses(profile, part) and camera in self.parts("camera"):
                made: Camera = self.make_or_skip(camera)
                return made
        return None

    def _is_for(self, path: Path) -> bool:
        """Return whether a shipped profile uses this plugin, and none that is not installed."""
        plugins = _plugins_named_by(path)
        if self.name == "core":
            return plugins == {"core"}
        installed = {"core", *(offer.name for offer in installed_offers())}
        return self.name in plugins and plugins <= installed


@cache
def _plugins_named_by(path: Path) -> frozenset[str]:
    """Return the plugins of the components in a shipped profile."""
    try:
        profile = load_profile(path, components=False)
    except TactileError:
        return frozenset()
    return frozenset(component.use.partition(".")[0] for component in profile.components.values())


def _uses(profile: Profile, part: Part) -> bool:
    named: list[Component] = list(profile.components.values())
    return any(component.use == part.use for component in named)
