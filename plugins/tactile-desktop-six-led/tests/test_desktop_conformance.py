from tactile_core.testing import PluginConformance


class TestDesktopSixLed(PluginConformance):
    plugin = "desktop_six_led"
