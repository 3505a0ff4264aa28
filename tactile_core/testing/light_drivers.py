"""Checks of light drivers: setting levels, refusing invalid ones, switching off."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.errors import DeviceError
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import opened
from tactile_core.testing.faults import CannotCheck, Fault
from tactile_core.testing.registered import Part, Registered


class LightDriverChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.light_driver.LightDriver`."""

    @check(Registered.light_drivers)
    def test_levels(self, part: Part) -> None:
        """An open driver accepts its profiles' levels and refuses 1.5; a closed one refuses all."""
        driver = self._driver(part)
        levels = [exposure.levels for exposure in self.registered.exposures(part)]
        name = next(iter(levels[0]), "light")
        self._must_refuse(part, driver, {name: 1.0}, DeviceError, "it is closed")
        with opened(driver):
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
        opened(driver)
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
