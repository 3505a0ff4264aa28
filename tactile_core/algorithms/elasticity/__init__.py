"""Mechanics of an elastic layer: its compliance, and what loads on its surface move."""

from tactile_core.algorithms.elasticity.elastic_layer import (
    GEL,
    POISSON_RATIO,
    SHEAR_MODULUS_MPA,
    THICKNESS_MM,
    Compliance,
    Elastomer,
)

__all__ = [
    "GEL",
    "POISSON_RATIO",
    "SHEAR_MODULUS_MPA",
    "THICKNESS_MM",
    "Compliance",
    "Elastomer",
]
