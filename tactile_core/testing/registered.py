"""What a plugin registers, and its parts made ready to be tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from tactile_core.errors import PluginError, TactileError
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Calibrator
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.device import Device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.interfaces.illumination import Exposure
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.pipeline.playback import make_lights
from tactile_core.plugins.plugin import KINDS, ComponentKind, Plugin
from tactile_core.plugins.registry import find_plugin, resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.testing.faults import Unjudged
from tactile_core.testing.virtual_presses import Rig, full_rig, generic_rig, small_rig


@dataclass(frozen=True)
class Part:
    """A registered component: its kind, and its name as profiles say it."""

    kind: ComponentKind
    use: str

    def __str__(self) -> str:
        return f"{self.kind} {self.use}"


@dataclass(frozen=True)
class ProfileFile:
    """A profile that the plugin brings, or a shipped one that is written for it."""

    path: Path

    def __str__(self) -> str:
        return f"profile {self.path.stem}"


class Registered:
    """A plugin's parts, each made when it is asked for.

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
        """The imported plugin; None where that fails."""
        try:
            return find_plugin(self.name)
        except PluginError:
            return None

    def parts(self, *kinds: ComponentKind) -> list[Part]:
        """Components of some kinds, or of all."""
        found = []
        for kind in kinds or KINDS:
            try:
                names = self.plugin.components(kind) if self.plugin is not None else ()
            except PluginError:
                continue
            found += [Part(kind, f"{self.name}.{name}") for name in names]
        return found

    def cameras(self) -> list[Part]:
        """The plugin's cameras."""
        return self.parts("camera")

    def illuminations(self) -> list[Part]:
        """What the plugin knows of lights."""
        return self.parts("illumination")

    def light_drivers(self) -> list[Part]:
        """What switches lights."""
        return self.parts("light_driver")

    def devices(self) -> list[Part]:
        """What is opened and closed."""
        return self.parts("camera", "light_driver")

    def calibrators(self) -> list[Part]:
        """The plugin's calibrators."""
        return self.parts("calibrator")

    def artefacts(self) -> list[Part]:
        """What the plugin's calibrators fit, and other fitted parts."""
        return self.parts("artefact")

    def estimators(self) -> list[Part]:
        """The plugin's estimators."""
        return self.parts("estimator")

    def sinks(self) -> list[Part]:
        """The plugin's sinks."""
        return self.parts("sink")

    def makeable(self) -> list[Part]:
        """What is made from its options."""
        return self.parts(
            "camera", "illumination", "light_driver", "calibrator", "estimator", "sink"
        )

    def profiles(self) -> list[ProfileFile]:
        """The plugin's profiles, and the shipped ones that use it."""
        import sensor_profiles

        own: Path | None = None
        with suppress(PluginError):
            own = self.plugin.profile_directory() if self.plugin is not None else None
        found = [] if own is None else sorted(own.glob("*.yaml"))
        shipped = sorted(sensor_profiles.DIRECTORY.glob("*.yaml"))
        return [ProfileFile(path) for path in found + [p for p in shipped if self._is_for(p)]]

    @cached_property
    def sound_profiles(self) -> list[Profile]:
        """Profiles that tell how components are used: the plugin's; for the core, all shipped."""
        import sensor_profiles

        paths = [file.path for file in self.profiles()]
        if self.name == "core":
            paths += sorted(set(sensor_profiles.DIRECTORY.glob("*.yaml")) - set(paths))
        sound = []
        for path in paths:
            with suppress(TactileError):
                sound.append(load_profile(path))
        return sound

    def class_of(self, part: Part) -> Any:
        """The component's class.

        Raises
        ------
        Unjudged
            It cannot be imported.
        """
        try:
            return resolve(part.kind, part.use)
        except PluginError as error:
            raise Unjudged(f"see the check 'components': {error}") from error

    def options(self, part: Part) -> BaseModel:
        """Options under which a component is tried; pydantic's error where they are wrong."""
        options: type[BaseModel] = self.class_of(part).Options
        return options.model_validate(self._said(part))

    def make(self, part: Part, context: SensorContext | None = None) -> Any:
        """Make a component anew; whatever its constructor raises is raised."""
        cls = self.class_of(part)
        if issubclass(cls, Camera):
            return cls.of(self.options(part), self.rig(part).profile)
        if not issubclass(cls, Estimator):
            return cls(self.options(part))
        return cls(self.options(part), context or self.rig(part).context)

    def made(self, part: Part) -> Any:
        """A component, newly made.

        Raises
        ------
        Unjudged
            It cannot be made.
        """
        try:
            return self.make(part)
        except Unjudged:
            raise
        except Exception as error:
            raise Unjudged(f"see the check 'construction': {error}") from error

    def device(self, part: Part) -> Device:
        """A closed device; light drivers have met their camera.

        Raises
        ------
        Unjudged
            It cannot be made.
        """
        device: Device = self.made(part)
        camera = self._companion(part) if isinstance(device, LightDriver) else None
        if isinstance(device, LightDriver) and (camera := self._companion(part)) is not None:
            try:
                device.attach(camera)
            except Exception as error:
                raise Unjudged(f"it does not take its profile's camera: {error}") from error
        return device

    def exposures(self, part: Part) -> Sequence[Exposure]:
        """The exposures of a profile that uses a camera or light driver; else one, in the dark."""
        for profile in self.sound_profiles:
            if _uses(profile, part):
                with suppress(TactileError):
                    return make_lights(profile).exposures()
        return (Exposure({}, ()),)

    def rig(self, part: Part) -> Rig:
        """A virtual rig with the light and the gel of a profile that uses the component, if any.

        A calibrator's is small. An estimator's has the size of the profile, to which weights may
        belong, and its markers.
        """
        if part not in self._rigs:
            users = [p for p in self.sound_profiles if _uses(p, part)]
            if part.kind == "estimator":
                rigs = (full_rig(profile) for profile in users)
            else:
                rigs = (small_rig(profile) for profile in [*users, *self.sound_profiles])
            self._rigs[part] = next((rig for rig in rigs if rig is not None), generic_rig())
        return self._rigs[part]

    def fit(self, part: Part) -> Calibration:
        """A calibration newly fitted on virtual presses by a calibrator."""
        rig = self.rig(part)
        calibrator: Calibrator = self.make(part)
        return calibrator.fit(rig.presses, rig.reference)

    def fitted(self, part: Part) -> Calibration:
        """A calibration that was fitted once for all checks.

        Raises
        ------
        Unjudged
            It cannot be fitted.
        """
        if part not in self._fits:
            try:
                self._fits[part] = self.fit(part)
            except Exception as error:
                self._fits[part] = error
        fitted = self._fits[part]
        if not isinstance(fitted, Calibration):
            raise Unjudged(f"see the check 'fit': {fitted}")
        return fitted

    def _said(self, part: Part) -> Mapping[str, Any]:
        if part.use in self._options:
            return self._options[part.use]
        named = [c for p in self.sound_profiles for c in p.components.values()]
        return next((c.options for c in named if c.use == part.use), {})

    def _companion(self, part: Part) -> Camera | None:
        """The camera that a profile puts beside a light driver of this plugin."""
        for profile in self.sound_profiles:
            camera = Part("camera", profile.camera.use)
            if _uses(profile, part) and camera in self.cameras():
                made: Camera = self.made(camera)
                return made
        return None

    def _is_for(self, path: Path) -> bool:
        """Whether a shipped profile is this plugin's; those of the core alone are the core's."""
        plugins = _plugins_named_by(path)
        return plugins == {"core"} if self.name == "core" else self.name in plugins


@cache
def _plugins_named_by(path: Path) -> frozenset[str]:
    """Plugins of the components that a shipped profile names."""
    try:
        profile = load_profile(path, components=False)
    except TactileError:
        return frozenset()
    return frozenset(component.use.partition(".")[0] for component in profile.components.values())


def _uses(profile: Profile, part: Part) -> bool:
    named: list[Component] = list(profile.components.values())
    return any(component.use == part.use for component in named)
