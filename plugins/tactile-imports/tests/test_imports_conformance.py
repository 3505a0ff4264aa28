from tactile_core.testing import PluginConformance


class TestImports(PluginConformance):
    plugin = "imports"
