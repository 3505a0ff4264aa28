import pytest

from tactile_core.testing import PluginConformance

pytestmark = pytest.mark.usefixtures("kernels_or_numpy")


class TestDesktopSixLed(PluginConformance):
    plugin = "desktop_six_led"
