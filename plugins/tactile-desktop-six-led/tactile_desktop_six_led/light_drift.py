"""Lamps that have become brighter or darker than at calibration, told by the other lamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_desktop_six_led.redundancy import Redundancy

Float32 = NDArray[np.float32]

MOST = 0.1
"""Larger changes are no drift."""

_SLOPED = (0.4, 0.8)
"""Sines of the slopes that tell: flat skin cannot tell a lamp from a tilt, steep is shadowed."""

_ORDER = 3
_PRIOR = 8e-2
_FEW = 50
_COMMON = 10.0


@dataclass(frozen=True, eq=False)
class LightDrift:
    """What the redundant combinations of lamps say about each lamp's brightness.

    If lamp k has become brighter by δ_k, the combinations that should vanish are those of
    δ_k · (1 + response_k) instead. That differs from slope to slope, so that one frame with a
    contact gives all δ by least squares; what is common to all lamps does not change the normal
    and is left alone. Where nothing slopes, nothing is followed. Skin at rest would tell as well,
    and wrongly: between contacts it is brighter than untouched by some per cent.

    Attributes
    ----------
    structure : (9, K − 3) float32
        What is left of the combinations at calibration, as a polynomial of the sines.
    exponents : (K,) float32
        Of the lamps' responses.
    zero : (K,) float32
        Change of the linear responses that the frames of the calibration themselves seem to show.
    """

    structure: Float32
    exponents: Float32
    zero: Float32

    def gains(self, response: Float32, normal_xy: Float32, redundancy: Redundancy) -> Float32:
        """(K,) brightness of each lamp over that at calibration, 1 where nothing tells.

        Parameters
        ----------
        response : (K, N) float32
            Of some pixels of a frame.
        normal_xy : (2, N) float32
            Of their slopes, as they seem.
        redundancy : Redundancy
        """
        lights = len(response)
        if not len(redundancy.combinations):
            return np.ones(lights, np.float32)
        steep = np.hypot(normal_xy[0], normal_xy[1])
        telling = (steep > _SLOPED[0]) & (steep < _SLOPED[1])
        seen = response[:, telling]
        left = redundancy.combinations @ seen - self.structure.T @ _terms(normal_xy[:, telling])
        fits = np.einsum("cn,cn->n", left, left) < redundancy.tolerance**2
        left, lit = left[:, fits], 1 + seen[:, fits]
        count = _FEW + lit.shape[1]
        # combinations · diag(1 + response) per pixel; its normal equations by lamp pairs
        weights = redundancy.combinations.T @ redundancy.combinations
        normal = weights * (lit @ lit.T) / count
        along = ((redundancy.combinations.T @ left) * lit).sum(axis=1) / count
        along -= normal @ self.zero
        normal += _PRIOR * np.eye(lights) + _COMMON * np.outer(self.exponents, self.exponents)
        change = np.clip(np.linalg.solve(normal, along), -MOST, MOST)
        return np.asarray((1 + change) ** (1 / self.exponents), np.float32)


def fit_light_drift(
    response: Float32, normal_xy: Float32, exponents: Float32, redundancy: Redundancy
) -> LightDrift:
    """Learn what is left of the combinations on (K, N) responses of skin with (2, N) sines."""
    left = redundancy.combinations @ response
    structure = np.linalg.lstsq(_terms(normal_xy).T, left.T, rcond=None)[0]
    return LightDrift(structure.astype(np.float32), exponents, np.zeros_like(exponents))


def _terms(normal_xy: Float32) -> Float32:
    """(9, N) products of the two sines up to the third order, without the constant."""
    x, y = normal_xy
    powers = [(i, j) for i in range(_ORDER + 1) for j in range(_ORDER + 1 - i) if i + j]
    return np.stack([x**i * y**j for i, j in powers])
