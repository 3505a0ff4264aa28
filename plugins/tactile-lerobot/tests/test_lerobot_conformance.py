from tactile_core.testing import PluginConformance


class TestLerobot(PluginConformance):
    plugin = "lerobot"
