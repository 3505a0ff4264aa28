"""Drift of each light's brightness since calibration, estimated from the other lights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_desktop_six_led.redundancy import Redundancy

Float32 = NDArray[np.float32]


class LED_DRIFT:
    """Parameters of drift estimation.

    Nothing sets them; responses are relative to the reference.
    """

    # [relative change of the linear response] Larger changes are not drift and are limited to
    # this one. Source: as for the drift of the other models (ADR 10).
    largest_change = 0.1
    # [sine of the slope angle] Pixels with slopes in between are used. On level gel a brighter
    # light is indistinguishable from a tilt; steep slopes are in shadow.
    least_sine = 0.4
    largest_sine = 0.8
    structure_order = 3  # [order] Order of the polynomial of the residual at calibration
    prior = 8e-2  # [weight] Ridge penalty of the change of each light
    # [count] Added to the number of pixels, so that few pixels cause small corrections.
    prior_samples: float = 50
    # [weight] Penalty of a change that all lights have in common, which does not affect the
    # normal.
    common_prior = 10.0


@dataclass(frozen=True, eq=False)
class LightDrift:
    """Estimates the brightness of each light from the redundancy of the lights.

    If light k has become brighter by δ_k, the vanishing combinations of responses become those of
    δ_k · (1 + response_k). These differ from slope to slope, so that one frame with a contact
    determines all δ by least squares. A change common to all lights does not affect the normal and
    is not estimated. Without sloped pixels there is no correction. Undeformed pixels are not used:
    between contacts the gel is brighter than in the reference by some per cent.

    Attributes
    ----------
    structure : (9, K − 3) float32
        Residual of the combinations at calibration, as a polynomial of normal_xy.
    exponents : (K,) float32
        Exponents of the lights' responses.
    zero : (K,) float32
        Change of the linear responses that is estimated on the calibration frames themselves.
    """

    structure: Float32
    exponents: Float32
    zero: Float32

    def gains(self, response: Float32, normal_xy: Float32, redundancy: Redundancy) -> Float32:
        """Return the (K,) brightness of each light relative to calibration; 1 if undetermined.

        Parameters
        ----------
        response : (K, N) float32
            Linear responses of some pixels of a frame.
        normal_xy : (2, N) float32
            Their normals' components, estimated without drift compensation.
        redundancy : Redundancy
        """
        lights = len(response)
        if not len(redundancy.combinations):
            return np.ones(lights, np.float32)
        steep = np.hypot(normal_xy[0], normal_xy[1])
        usable = (steep > LED_DRIFT.least_sine) & (steep < LED_DRIFT.largest_sine)
        used = response[:, usable]
        expected = self.structure.T @ _terms(normal_xy[:, usable])
        residual = redundancy.combinations @ used - expected
        inliers = np.einsum("cn,cn->n", residual, residual) < redundancy.tolerance**2
        residual, lit = residual[:, inliers], 1 + used[:, inliers]
        count = LED_DRIFT.prior_samples + lit.shape[1]
        # combinations · diag(1 + response) per pixel; its normal equations by pairs of lights
        weights = redundancy.combinations.T @ redundancy.combinations
        normal = weights * (lit @ lit.T) / count
        right = ((redundancy.combinations.T @ residual) * lit).sum(axis=1) / count
        right -= normal @ self.zero
        common = np.outer(self.exponents, self.exponents)
        normal += LED_DRIFT.prior * np.eye(lights) + LED_DRIFT.common_prior * common
        most = LED_DRIFT.largest_change
        change = np.clip(np.linalg.solve(normal, right), -most, most)
        return np.asarray((1 + change) ** (1 / self.exponents), np.float32)


def fit_light_drift(
    response: Float32, normal_xy: Float32, exponents: Float32, redundancy: Redundancy
) -> LightDrift:
    """Fit the residual of the combinations on (K, N) responses with normals (2, N) normal_xy."""
    residual = redundancy.combinations @ response
    structure = np.linalg.lstsq(_terms(normal_xy).T, residual.T, rcond=None)[0]
    return LightDrift(structure.astype(np.float32), exponents, np.zeros_like(exponents))


def _terms(normal_xy: Float32) -> Float32:
    """Return (9, N) monomials of the two components up to the third order, no constant."""
    x, y = normal_xy
    order = LED_DRIFT.structure_order
    powers = [(i, j) for i in range(order + 1) for j in range(order + 1 - i) if i + j]
    return np.stack([x**i * y**j for i, j in powers])
