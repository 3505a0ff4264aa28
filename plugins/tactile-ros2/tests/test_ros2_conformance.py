from tactile_core.testing import PluginConformance


class TestRos2(PluginConformance):
    plugin = "ros2"
