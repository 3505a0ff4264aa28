from tactile_core.testing import PluginConformance


class TestExampleEstimator(PluginConformance):
    plugin = "example_estimator"
