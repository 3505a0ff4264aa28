"""Checks of illuminations and light drivers."""

from __future__ import annotations

import math
import pickle
from collections.abc import Sequence

from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import open_device
from tactile_core.testing.differences import CannotCheck, report, report_errors
from tactile_core.testing.registered import Part


class IlluminationChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.illumination.Illumination`."""

    @check("illumination")
    def test_exposures(self, part: Part) -> None:
        """The exposures measure every channel once, in the channels' order, at levels 0..1."""
        light: Illumination = self.registered.make_or_skip(part)
        with report_errors(
            part,
            "exposures() fails",
            why="no frame can be acquired",
            do="derive the sequence from the options, without the hardware",
        ):
            wrong = _fault_of_exposures(light.exposures(), tuple(light.channels))
        report(
            part,
            wrong,
            why="acquisition stacks the images of the exposures into the frame's channels, which "
            "bundles identify by their names",
            do="return a sequence of Exposure(levels, channels); a dark one has no channels",
        )

    @check("illumination")
    def test_lights(self, part: Part) -> None:
        """Lights have unique names and valid positions, and include every light in use, or none."""
        illumination = self._sound(part)
        report(
            part,
            _fault_of_lights(illumination.lights, illumination.exposures()),
            why="the virtual sensor and measurements without a bundle use the positions",
            do="return a Light(name, azimuth_deg, elevation_deg) for each light, or none",
        )

    @check("illumination")
    def test_determinism(self, part: Part) -> None:
        """The same options, and a pickled copy, give the same exposures, channels and lights."""
        first = self._sound(part)
        why = "the model of one channel would be applied to another light"
        do = "derive them from the options, and store only these and plain values"
        with report_errors(part, "it cannot be pickled", why=why, do=do):
            copy = pickle.loads(pickle.dumps(first))
        others = {"read again": first, "made again": self._sound(part), "pickled": copy}
        expected = _description(first)
        for when, other in others.items():
            found = f"its exposures, channels or lights differ when it is {when}"
            report(part, "" if _description(other) == expected else found, why=why, do=do)

    def _sound(self, part: Part) -> Illumination:
        light: Illumination = self.registered.make_or_skip(part)
        try:
            wrong = _fault_of_exposures(light.exposures(), tuple(light.channels))
        except Exception as error:
            wrong = str(error)
        if wrong:
            raise CannotCheck(f"see the check 'exposures': {wrong}")
        return light


def _description(illumination: Illumination) -> tuple[object, ...]:
    return illumination.exposures(), tuple(illumination.channels), illumination.lights


def _fault_of_exposures(exposures: Sequence[Exposure], channels: tuple[str, ...]) -> str:
    if not channels or not all(channels) or len(set(channels)) < len(channels):
        return f"its channels are {channels!r}"
    if not exposures or not all(isinstance(exposure, Exposure) for exposure in exposures):
        return f"exposures() returns {exposures!r}"
    shown = tuple(name for exposure in exposures for name in exposure.channels)
    if shown != channels:
        return f"its exposures measure {shown}, but its channels are {channels}"
    for exposure in exposures:
        outside = {n: level for n, level in exposure.levels.items() if not 0 <= level <= 1}
        if outside:
            return f"levels outside 0..1: {outside}"
        if exposure.channels and not any(exposure.levels.values()):
            return f"no light is on in the exposure that measures {exposure.channels}"
        if exposure.color is not None and len(exposure.channels) != 1:
            return f"an exposure of one color measures {exposure.channels}"
        for name in ("exposure_time_s", "gain"):
            value = getattr(exposure, name)
            if value is not None and not 0 < value < math.inf:
                return f"an exposure's {name} is {value!r}"
    return ""


def _fault_of_lights(lights: Sequence[Light], exposures: Sequence[Exposure]) -> str:
    if not isinstance(lights, tuple) or not all(isinstance(light, Light) for light in lights):
        return f"its lights are {lights!r}"
    names = [light.name for light in lights]
    if not all(names) or len(set(names)) < len(names):
        return f"its lights are named {', '.join(map(repr, names))}"
    for light in lights:
        if not (math.isfinite(light.azimuth_deg) and 0 <= light.elevation_deg <= 90):
            return f"it has {light}, which is not a position above the gel"
    used = dict.fromkeys(name for exposure in exposures for name in exposure.levels)
    missing = [name for name in used if names and name not in names]
    return f"its exposures use {', '.join(missing)}, missing from its lights" if missing else ""


class LightDriverChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.light_driver.LightDriver`."""

    @check("light_driver")
    def test_levels(self, part: Part) -> None:
        """An open driver accepts the levels of its profiles."""
        driver = self.registered.device(part)
        assert isinstance(driver, LightDriver)
        with open_device(driver):
            for exposure in self.registered.exposures(part):
                with report_errors(
                    part,
                    f"set({dict(exposure.levels)}) fails",
                    why="the light sequence of its own profile fails",
                    do="accept in _set the light names of the profile's illumination",
                ):
                    driver.set(exposure.levels)
