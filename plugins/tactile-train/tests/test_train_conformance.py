from tactile_core.testing import PluginConformance


class TestTrain(PluginConformance):
    plugin = "train"
