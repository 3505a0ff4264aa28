"""The truth of a virtual sensor as quantities, to be shown beside what was measured."""

from __future__ import annotations

import numpy as np

from tactile_core.quantities import ContactMask, DisplacementField, HeightMap, Quantity, Wrench
from tactile_core.sim.truth import TrueState


def true_quantities(truth: TrueState) -> tuple[Quantity, ...]:
    """Return height, contact, displacement and force, as a perfect sensor would measure them."""
    everywhere = np.ones(truth.height_mm.shape, np.bool_)
    fx, fy, fz, tz = map(float, truth.wrench)
    return (
        HeightMap(truth.height_mm, everywhere, truth.mm_per_px, truth.time_s),
        ContactMask(truth.contact, truth.mm_per_px, truth.time_s),
        DisplacementField(truth.displacement_mm, everywhere, truth.mm_per_px, truth.time_s),
        Wrench(fx, fy, fz, tz, timestamp_s=truth.time_s),
    )
