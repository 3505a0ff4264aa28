from tactile_core.testing import PluginConformance


class TestExampleDepth(PluginConformance):
    plugin = "example_depth"
