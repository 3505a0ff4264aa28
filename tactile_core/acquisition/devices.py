"""The devices of a sensor, made from its profile, and what its lights are."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_core.plugins.blame import blame, fault
from tactile_core.plugins.options import options_of
from tactile_core.plugins.registry import resolve

if TYPE_CHECKING:
    from tactile_core.interfaces.camera import Camera
    from tactile_core.interfaces.component import SensorBuild
    from tactile_core.interfaces.light_driver import LightDriver
    from tactile_core.profiles.model import Profile

# Names used in messages.
CAMERA, DRIVER, LIGHTS = "the camera", "the light driver", "the lights"


class Devices(NamedTuple):
    """The devices of a sensor, not yet open.

    Attributes
    ----------
    camera : Camera
    illumination : Illumination
    driver : LightDriver or None
        Switches the lights; None if the profile names none or the camera is not live.
    """

    camera: Camera
    illumination: Illumination
    driver: LightDriver | None


def make_devices(profile: Profile) -> Devices:
    """Make the camera, the illumination and the light driver that a profile names."""
    camera: type[Camera] = resolve("camera", profile.camera.use)
    with blame(CAMERA, camera):
        made = camera.for_build(options_of(camera, profile.camera), profile)
    return Devices(made, make_lights(profile), _make_driver(profile) if made.live else None)


def make_lights(build: SensorBuild) -> Illumination:
    """Make the description of a sensor's lights: positions and exposures."""
    lights: type[Illumination] = resolve("illumination", build.illumination.use)
    with blame(LIGHTS, lights):
        return lights(options_of(lights, build.illumination))


def _make_driver(profile: Profile) -> LightDriver | None:
    component = profile.illumination.driver
    if component is None:
        return None
    driver: type[LightDriver] = resolve("light_driver", component.use)
    with blame(DRIVER, driver):
        return driver(options_of(driver, component))


def images_per_observation(profile: Profile) -> int:
    """Return the number of exposures per observation, including a dark one."""
    return len(exposures_of(make_lights(profile)))


def exposures_of(lights: Illumination) -> tuple[Exposure, ...]:
    """Return the exposures of one observation.

    Raises
    ------
    PluginFault
        The result has the wrong type, or the exposures do not measure every channel once.
    """
    with blame(LIGHTS, lights):
        exposures, channels = tuple(lights.exposures()), tuple(lights.channels)
        measured = sum(len(exposure.channels) for exposure in exposures)
    if not measured == len(channels) > 0:
        raise fault(LIGHTS, lights, f"have {len(channels)} channels and exposures for {measured}")
    return exposures


def lights_of(illumination: Illumination) -> tuple[Light, ...]:
    """Return the lights and their positions; empty if they are unknown.

    Raises
    ------
    PluginFault
        The result has the wrong type.
    """
    with blame(LIGHTS, illumination):
        lights = tuple(illumination.lights)
    if not all(isinstance(light, Light) for light in lights):
        raise fault(LIGHTS, illumination, f"include {lights!r}, which is not a tuple of Light")
    return lights
