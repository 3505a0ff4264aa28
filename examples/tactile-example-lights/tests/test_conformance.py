from tactile_core.testing import PluginConformance


class TestExampleLights(PluginConformance):
    plugin = "example_lights"
