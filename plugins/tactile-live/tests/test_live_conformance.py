from tactile_core.testing import PluginConformance


class TestLive(PluginConformance):
    plugin = "live"
