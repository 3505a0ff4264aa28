from tactile_core.testing import PluginConformance


class TestGelSightWedge(PluginConformance):
    plugin = "gelsight_wedge"
