"""Mechanics of an elastic layer: its compliance, and what loads on its surface move."""

from tactile_core.algorithms.elasticity.elastic_layer import (
    POISSON_RATIO,
    SHEAR_MODULUS_MPA,
    THICKNESS_MM,
    Compliance,
    Elastomer,
)

__all__ = [
    "POISSON_RATIO",
    "SHEAR_MODULUS_MPA",
    "THICKNESS_MM",
    "Compliance",
    "Elastomer",
]
