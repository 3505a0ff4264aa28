"""Checks of illuminations: where the lights are, which channels there are, what an exposure shows.

They are descriptions: nothing is opened.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Sequence

from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.registered import Part, Registered


class IlluminationChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.illumination.Illumination`."""

    @check(Registered.illuminations)
    def test_channels(self, part: Part) -> None:
        """Channels have names, each its own."""
        channels = self._illumination(part).channels
        if (
            not channels
            or len(set(channels)) < len(channels)
            or not all(isinstance(name, str) and name for name in channels)
        ):
            raise Fault(
                part,
                f"its channels are {channels!r}",
                why="a frame's intensities and a bundle's model are told apart by these names",
                do="name each channel, none twice",
            )

    @check(Registered.illuminations)
    def test_exposures(self, part: Part) -> None:
        """The exposures measure every channel once, in the channels' order, at levels 0..1."""
        light = self._illumination(part, judged=True)
        exposures = light.exposures()
        wrong = _what_is_wrong_with(exposures, tuple(light.channels))
        if wrong:
            raise Fault(
                part,
                wrong,
                why="acquisition stacks the exposures' images into the frame's channels",
                do="return one Exposure(levels, channels) after another; a dark one has none",
            )

    @check(Registered.illuminations)
    def test_lights(self, part: Part) -> None:
        """Lights have a name, each its own, and a place; given any, none that shines is missing."""
        illumination = self._illumination(part)
        if _what_is_wrong_with(illumination.exposures(), tuple(illumination.channels)):
            raise Unjudged("see the check 'exposures'")
        wrong = _what_is_wrong_with_lights(illumination.lights, illumination.exposures())
        if wrong:
            raise Fault(
                part,
                wrong,
                why="the virtual sensor and what is measured without a bundle rely on them",
                do="return a Light(name, azimuth_deg, elevation_deg) for each, or none at all",
            )

    @check(Registered.illuminations)
    def test_order(self, part: Part) -> None:
        """The sequence is the same whenever it is asked for, and whoever made it."""
        first = self._illumination(part)
        told = _told(first)
        for again, other in (("asked again", first), ("made again", self._illumination(part))):
            if _told(other) != told:
                raise Fault(
                    part,
                    f"its exposures, channels or lights differ when it is {again}",
                    why="the model of one channel would read another one's light",
                    do="let them follow from the options alone",
                )

    @check(Registered.illuminations)
    def test_illumination_pickling(self, part: Part) -> None:
        """An illumination pickles, and says the same afterwards."""
        illumination = self._illumination(part)
        try:
            copy = pickle.loads(pickle.dumps(illumination))
        except Exception as error:
            found = f"it does not pickle ({type(error).__name__}: {error})"
        else:
            found = "" if _told(copy) == _told(illumination) else "its pickled copy says otherwise"
        if found:
            raise Fault(
                part,
                found,
                why="a pipeline holds it, and recordings are measured in several processes",
                do="keep the options and plain values; what switches lights is a LightDriver",
            )

    def _illumination(self, part: Part, *, judged: bool = False) -> Illumination:
        illumination = self.registered.made(part)
        assert isinstance(illumination, Illumination)
        try:
            illumination.exposures()
        except Exception as error:
            if not judged:
                raise Unjudged(f"see the check 'exposures': {error}") from error
            raise Fault(
                part,
                f"exposures() fails ({type(error).__name__}: {error})",
                why="nothing can be observed",
                do="make the sequence of its options alone, without the hardware",
            ) from error
        return illumination


def _told(illumination: Illumination) -> tuple[object, ...]:
    return illumination.exposures(), tuple(illumination.channels), illumination.lights


def _what_is_wrong_with(exposures: Sequence[Exposure], channels: tuple[str, ...]) -> str:
    if not exposures or not all(isinstance(exposure, Exposure) for exposure in exposures):
        return f"exposures() returns {exposures!r}"
    shown = tuple(name for exposure in exposures for name in exposure.channels)
    if shown != channels:
        return f"its exposures measure {shown}, and its channels are {channels}"
    for exposure in exposures:
        outside = {n: level for n, level in exposure.levels.items() if not 0 <= level <= 1}
        if outside:
            return f"levels outside 0..1: {outside}"
        if exposure.channels and not any(exposure.levels.values()):
            return f"no light shines in the exposure that measures {exposure.channels}"
        for name in ("exposure_time_s", "gain"):
            value = getattr(exposure, name)
            if value is not None and not 0 < value < math.inf:
                return f"an exposure's {name} is {value!r}"
    return ""


def _what_is_wrong_with_lights(lights: Sequence[Light], exposures: Sequence[Exposure]) -> str:
    if not isinstance(lights, tuple) or not all(isinstance(light, Light) for light in lights):
        return f"its lights are {lights!r}"
    names = [light.name for light in lights]
    if not all(names) or len(set(names)) < len(names):
        return f"its lights are named {', '.join(map(repr, names))}"
    for light in lights:
        if not (math.isfinite(light.azimuth_deg) and 0 <= light.elevation_deg <= 90):
            return f"it has {light}, which is no place above the gel"
    shining = dict.fromkeys(name for exposure in exposures for name in exposure.levels)
    missing = [name for name in shining if names and name not in names]
    return f"{', '.join(missing)} shine, and are none of its lights" if missing else ""
