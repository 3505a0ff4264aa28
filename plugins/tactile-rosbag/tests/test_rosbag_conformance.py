from tactile_core.testing import PluginConformance


class TestRosbag(PluginConformance):
    plugin = "rosbag"
