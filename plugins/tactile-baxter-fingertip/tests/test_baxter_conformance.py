from tactile_core.testing import PluginConformance


class TestBaxterFingertip(PluginConformance):
    plugin = "baxter_fingertip"
