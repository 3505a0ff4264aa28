from tactile_core.testing import PluginConformance


class TestSim(PluginConformance):
    plugin = "sim"
