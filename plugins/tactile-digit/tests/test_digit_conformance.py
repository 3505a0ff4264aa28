from tactile_core.testing import PluginConformance


class TestDigit(PluginConformance):
    plugin = "digit"
