from tactile_core.testing import PluginConformance


class TestGelSightMini(PluginConformance):
    plugin = "gelsight_mini"
