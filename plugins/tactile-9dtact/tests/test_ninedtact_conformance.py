from tactile_core.testing import PluginConformance


class TestNineDTact(PluginConformance):
    plugin = "ninedtact"
