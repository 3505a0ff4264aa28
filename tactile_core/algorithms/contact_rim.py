"""How high the gel surface stands where it leaves a ball: a layer sinks beside a contact, too."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.elasticity import POISSON_RATIO, Elastomer

_LARGEST_WAVE, _WAVES = 60.0, 6000
"""Wave numbers of the integral, in inverse contact radii: the pressure has faded there."""


def rim_share(
    contact_radius_mm: float, thickness_mm: float, poisson_ratio: float = POISSON_RATIO
) -> float:
    """Height of a contact's rim over the undeformed surface, over the height of its top above it.

    Of Hertz's pressure √(1 − r²/a²) on a layer that is bonded to a plate: 1 on a half-space, less
    the thinner the layer is. On virtual sensors (balls of 4 and 8 mm, up to 0.8 mm deep in 2 mm of
    gel) it is right to 0.1.

    Parameters
    ----------
    contact_radius_mm, thickness_mm : float
    poisson_ratio : float
    """
    from scipy.special import j0

    ka = (np.arange(_WAVES) + 0.5) * (_LARGEST_WAVE / _WAVES)
    pressure = (np.sin(ka) - ka * np.cos(ka)) / ka**3
    layer = Elastomer(thickness_mm, 1.0, poisson_ratio)
    waves = pressure * layer.compliance(ka / contact_radius_mm).normal * ka
    top, rim = waves.sum(), (waves * j0(ka)).sum()
    return float(rim / (top - rim))
