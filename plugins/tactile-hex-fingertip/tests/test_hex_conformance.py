from tactile_core.testing import PluginConformance


class TestHexFingertip(PluginConformance):
    plugin = "hex_fingertip"
