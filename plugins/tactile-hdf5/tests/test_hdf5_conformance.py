from tactile_core.testing import PluginConformance


class TestHdf5(PluginConformance):
    plugin = "hdf5"
