"""Mechanics of an elastic layer: its compliance, and what loads on its surface move."""

from tactile_core.algorithms.elasticity.elastic_layer import Compliance, Elastomer

__all__ = ["Compliance", "Elastomer"]
