"""Force: the mechanics of an elastic layer, and regression of forces that were measured."""

from tactile_core.algorithms.force.elastic_layer import Compliance, Elastomer

__all__ = ["Compliance", "Elastomer"]
