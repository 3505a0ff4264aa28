"""The test class that a lab subclasses."""

from __future__ import annotations

import pytest

from tactile_core.testing.calibrations import CalibrationChecks
from tactile_core.testing.cameras import CameraChecks
from tactile_core.testing.checks import PREFIX, checks_of, subjects_of
from tactile_core.testing.devices import DeviceChecks
from tactile_core.testing.estimators import EstimatorChecks
from tactile_core.testing.faults import Fault
from tactile_core.testing.illuminations import IlluminationChecks
from tactile_core.testing.imports import ImportChecks
from tactile_core.testing.light_drivers import LightDriverChecks
from tactile_core.testing.profiles import ProfileChecks
from tactile_core.testing.registration import RegistrationChecks
from tactile_core.testing.sinks import SinkChecks


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
