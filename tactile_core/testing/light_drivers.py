"""Checks of light drivers: that lights obey, refuse what is no level, and go out."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.errors import DeviceError
from tactile_core.interfaces.light_driver import LightDriver
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.devices import opened
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.registered import Part, Registered


class LightDriverChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.light_driver.LightDriver`."""

    @check(Registered.light_drivers)
    def test_levels(self, part: Part) -> None:
        """Open lights take the levels of their profiles; closed ones and 1.5 are refused."""
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
                        why="the sequence of its own profile cannot be carried out",
                        do="let _set know the lights that the profile's illumination names",
                    ) from error
            self._must_refuse(part, driver, {name: 1.5}, ValueError, "1.5 is above full brightness")

    @check(Registered.light_drivers)
    def test_darkness(self, part: Part) -> None:
        """Closing switches every light off before it lets go of them."""
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
            raise Unjudged(f"see the check 'levels': {error}") from error
        done.clear()
        driver.close()
        if done[-2:] != [{}, "closed"]:
            raise Fault(
                part,
                "it closes without darkness",
                why="lights that nobody watches heat the gel and age",
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
            f"set({levels}) {found}, though {because}",
            why="a rig that stays dark, or burns its lights, goes unnoticed",
            do="do not override set(); it guards _set()",
        )

    def _driver(self, part: Part) -> LightDriver:
        driver = self.registered.device(part)
        assert isinstance(driver, LightDriver)
        return driver
