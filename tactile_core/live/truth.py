"""The truth of a virtual sensor as quantities, to be shown beside what was measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from tactile_core.quantities import ContactMask, DisplacementField, HeightMap, Quantity
from tactile_core.quantities.fields import FieldSpec
from tactile_core.sim.truth import TrueState


@dataclass(frozen=True, eq=False)
class AppliedForce(Quantity):
    """Force of the object on the gel.

    Attributes
    ----------
    fx_n, fy_n, fz_n : float
        fz is positive in compression.
    tz_nmm : float
        About the axis through the image centre, positive from x towards y.
    """

    fx_n: Annotated[float, FieldSpec("N", saved_as="applied.fx_n")]
    fy_n: Annotated[float, FieldSpec("N", saved_as="applied.fy_n")]
    fz_n: Annotated[float, FieldSpec("N", saved_as="applied.fz_n")]
    tz_nmm: Annotated[float, FieldSpec("N·mm", saved_as="applied.tz_nmm")]


def true_quantities(truth: TrueState) -> tuple[Quantity, ...]:
    """Return height, contact, displacement and force, as a perfect sensor would measure them."""
    everywhere = np.ones(truth.height_mm.shape, np.bool_)
    fx, fy, fz, tz = map(float, truth.wrench)
    return (
        HeightMap(truth.height_mm, everywhere, truth.mm_per_px, truth.time_s),
        ContactMask(truth.contact, truth.mm_per_px, truth.time_s),
        DisplacementField(truth.displacement_mm, everywhere, truth.mm_per_px, truth.time_s),
        AppliedForce(fx, fy, fz, tz),
    )
