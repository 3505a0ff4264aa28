from tactile_core.testing import PluginConformance


class TestGelSlim(PluginConformance):
    plugin = "gelslim"
