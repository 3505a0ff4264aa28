from tactile_core.testing import PluginConformance


class TestRerun(PluginConformance):
    plugin = "rerun"
