"""Checks of lights: which channels there are and what each exposure shows."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_core.errors import DeviceError
from tactile_core.interfaces.illumination import Exposure, Illumination
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import opened
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.registered import Part, Registered


class IlluminationChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.illumination.Illumination`."""

    @check(Registered.illuminations)
    def test_channels(self, part: Part) -> None:
        """Channels have names, each its own."""
        channels = self._light(part).channels
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
        light = self._light(part, judged=True)
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
    def test_order(self, part: Part) -> None:
        """The sequence is the same whenever it is asked for, closed or open."""
        light = self._light(part)
        first = light.exposures(), tuple(light.channels)
        with opened(light):
            for again in ("asked again", "asked when it is open"):
                if (light.exposures(), tuple(light.channels)) != first:
                    raise Fault(
                        part,
                        f"its exposures or channels differ when {again}",
                        why="the model of one channel would read another one's light",
                        do="fix the sequence in __init__",
                    )

    @check(Registered.illuminations)
    def test_levels(self, part: Part) -> None:
        """An open light takes the levels of its own exposures; a closed one and 1.5 are refused."""
        light = self._light(part)
        if _what_is_wrong_with(light.exposures(), tuple(light.channels)):
            raise Unjudged("see the check 'exposures'")
        levels = [exposure.levels for exposure in light.exposures()]
        self._must_refuse(part, light, levels[0], DeviceError, "it is closed")
        with opened(light):
            for one in levels:
                try:
                    light.set(one)
                except Exception as error:
                    raise Fault(
                        part,
                        f"set({dict(one)}) fails ({type(error).__name__}: {error})",
                        why="its own sequence cannot be carried out",
                        do="name in exposures() the lights that _set knows",
                    ) from error
            name = next(iter(levels[0]), "light")
            self._must_refuse(part, light, {name: 1.5}, ValueError, "1.5 is above full brightness")

    def _must_refuse(
        self,
        part: Part,
        light: Illumination,
        levels: object,
        expected: type[Exception],
        because: str,
    ) -> None:
        try:
            light.set(levels)  # type: ignore[arg-type]
        except expected:
            return
        except Exception as error:
            found = f"raises {type(error).__name__} instead of {expected.__name__}"
        else:
            found = f"is accepted instead of raising {expected.__name__}"
        raise Fault(
            part,
            f"set({levels}) {found}, though {because}",
            why="a rig that stays dark, or burns its lamps, goes unnoticed",
            do="do not override set(); it guards _set()",
        )

    def _light(self, part: Part, *, judged: bool = False) -> Illumination:
        light = self.registered.device(part)
        assert isinstance(light, Illumination)
        try:
            light.exposures()
        except Exception as error:
            if not judged:
                raise Unjudged(f"see the check 'exposures': {error}") from error
            raise Fault(
                part,
                f"exposures() fails ({type(error).__name__}: {error})",
                why="nothing can be observed",
                do="make the sequence of its options alone, without the hardware",
            ) from error
        return light


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
    return ""
