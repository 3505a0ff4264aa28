"""Checks of illuminations and light drivers."""

from __future__ import annotations

import math
import pickle
from collections.abc import Mapping, Sequence

from tactile_core.errors import DeviceError
from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import open_device
from tactile_core.testing.differences import CannotCheck, Fault
from tactile_core.testing.registered import Part, Registered


class IlluminationChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.illumination.Illumination`."""

    @check(Registered.illuminations)
    def test_channels(self, part: Part) -> None:
        """Channels have unique names."""
        channels = self._illumination(part).channels
        if (
            not channels
            or len(set(channels)) < len(channels)
            or not all(isinstance(name, str) and name for name in channels)
        ):
            raise Fault(
                part,
                f"its channels are {channels!r}",
                why="frames and bundles identify their channels by these names",
                do="give each channel a unique name",
            )

    @check(Registered.illuminations)
    def test_exposures(self, part: Part) -> None:
        """The exposures measure every channel once, in the channels' order, at levels 0..1."""
        light = self._illumination(part, report=True)
        exposures = light.exposures()
        wrong = _fault_of_exposures(exposures, tuple(light.channels))
        if wrong:
            raise Fault(
                part,
                wrong,
                why="acquisition stacks the images of the exposures into the frame's channels",
                do="return a sequence of Exposure(levels, channels); a dark one has no channels",
            )

    @check(Registered.illuminations)
    def test_lights(self, part: Part) -> None:
        """Lights have unique names and valid positions, and include every light in use, or none."""
        illumination = self._illumination(part)
        if _fault_of_exposures(illumination.exposures(), tuple(illumination.channels)):
            raise CannotCheck("see the check 'exposures'")
        wrong = _fault_of_lights(illumination.lights, illumination.exposures())
        if wrong:
            raise Fault(
                part,
                wrong,
                why="the virtual sensor and measurements without a bundle use the positions",
                do="return a Light(name, azimuth_deg, elevation_deg) for each light, or none",
            )

    @check(Registered.illuminations)
    def test_determinism(self, part: Part) -> None:
        """The same options always give the same exposures, channels and lights."""
        first = self._illumination(part)
        expected = _description(first)
        for again, other in (
            ("read again", first),
            ("constructed again", self._illumination(part)),
        ):
            if _description(other) != expected:
                raise Fault(
                    part,
                    f"its exposures, channels or lights differ when it is {again}",
                    why="the model of one channel would be applied to another light",
                    do="derive them only from the options",
                )

    @check(Registered.illuminations)
    def test_illumination_pickling(self, part: Part) -> None:
        """An illumination can be pickled, and its copy is the same."""
        illumination = self._illumination(part)
        try:
            copy = pickle.loads(pickle.dumps(illumination))
        except Exception as error:
            found = f"it cannot be pickled ({type(error).__name__}: {error})"
        else:
            same = _description(copy) == _description(illumination)
            found = "" if same else "its pickled copy differs"
        if found:
            raise Fault(
                part,
                found,
                why="it is part of the pipeline, which is pickled to run in other processes",
                do="store only options and plain values; control the lights in a LightDriver",
            )

    def _illumination(self, part: Part, *, report: bool = False) -> Illumination:
        illumination = self.registered.make_or_skip(part)
        assert isinstance(illumination, Illumination)
        try:
            illumination.exposures()
        except Exception as error:
            if not report:
                raise CannotCheck(f"see the check 'exposures': {error}") from error
            raise Fault(
                part,
                f"exposures() fails ({type(error).__name__}: {error})",
                why="no frame can be acquired",
                do="derive the sequence from the options, without the hardware",
            ) from error
        return illumination


def _description(illumination: Illumination) -> tuple[object, ...]:
    return illumination.exposures(), tuple(illumination.channels), illumination.lights


def _fault_of_exposures(exposures: Sequence[Exposure], channels: tuple[str, ...]) -> str:
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

    @check(Registered.light_drivers)
    def test_levels(self, part: Part) -> None:
        """An open driver accepts its profiles' levels and refuses 1.5; a closed one refuses all."""
        driver = self._driver(part)
        levels = [exposure.levels for exposure in self.registered.exposures(part)]
        name = next(iter(levels[0]), "light")
        self._must_refuse(part, driver, {name: 1.0}, DeviceError, "it is closed")
        with open_device(driver):
            for one in levels:
                try:
                    driver.set(one)
                except Exception as error:
                    raise Fault(
                        part,
                        f"set({dict(one)}) fails ({type(error).__name__}: {error})",
                        why="the light sequence of its own profile fails",
                        do="accept in _set the light names of the profile's illumination",
                    ) from error
            self._must_refuse(part, driver, {name: 1.5}, ValueError, "1.5 is above full brightness")

    @check(Registered.light_drivers)
    def test_lights_off(self, part: Part) -> None:
        """Closing switches all lights off before it releases the device."""
        driver = self._driver(part)
        done: list[object] = []
        switch, release = driver._set, driver._close

        def switched(levels: Mapping[str, float]) -> None:
            switch(levels)
            done.append(dict(levels))

        def released() -> None:
            done.append("closed")
            release()

        driver._set, driver._close = switched, released  # type: ignore[method-assign]
        open_device(driver)
        try:
            driver.set(self.registered.exposures(part)[0].levels)
        except Exception as error:
            driver.close()
            raise CannotCheck(f"see the check 'levels': {error}") from error
        done.clear()
        driver.close()
        if done[-2:] != [{}, "closed"]:
            raise Fault(
                part,
                "it closes without switching the lights off",
                why="lights that stay on heat the gel and age",
                do="do not override close(); it calls _set({}) and then _close()",
            )

    def _must_refuse(
        self,
        part: Part,
        driver: LightDriver,
        levels: Mapping[str, float],
        expected: type[Exception],
        because: str,
    ) -> None:
        try:
            driver.set(levels)
        except expected:
            return
        except Exception as error:
            found = f"raises {type(error).__name__} instead of {expected.__name__}"
        else:
            found = f"is accepted instead of raising {expected.__name__}"
        raise Fault(
            part,
            f"set({levels}) {found}, although {because}",
            why="lights that stay dark or are overdriven would go unnoticed",
            do="do not override set(); it guards _set()",
        )

    def _driver(self, part: Part) -> LightDriver:
        driver = self.registered.device(part)
        assert isinstance(driver, LightDriver)
        return driver
