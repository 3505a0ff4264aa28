from tactile_core.testing import PluginConformance


class TestCluster(PluginConformance):
    plugin = "cluster"
