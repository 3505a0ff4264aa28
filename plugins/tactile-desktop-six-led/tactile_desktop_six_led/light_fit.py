"""Fit of a light field to pixels with ground-truth slopes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression
from tactile_desktop_six_led.light_field import LEAST_RATIO, LightField

Float32 = NDArray[np.float32]
Float = NDArray[np.float64]


# [distance of normal_xy] Lower limit of the same, for data without noise: the slope of one grey
# level on recordings
_LEAST_HUBER = 0.005
_RIDGE = 0.03  # [weight] Penalty of the light field's distance from its start


def fit_light_field(
    features: Float32, normal_xy: Float32, *, tilted: bool = True, seed: int = 0
) -> tuple[LightField, Float32]:
    """Fit responses and light field to pixels with ground-truth slopes.

    The fit minimises the error of the normal with Huber's loss [1]_. Errors of intensities would
    weight all slopes equally and leave a bias in each. It starts from a field that is linear in the
    relative change. Shadows and wrong labels are outliers, and those that are only a few times the
    noise bend the field, too. So a first fit estimates the noise.

    Parameters
    ----------
    features : (N, K + 2) float32
        Relative change of each light, and position.
    normal_xy : (N, 2) float32
        Components of the normal along x and y, uphill.
    tilted : bool
        Whether to fit the tilt, which takes a grid of balls; otherwise it is 0.
    seed : int
        Seed of the random sample.

    Returns
    -------
    LightField
    tilt : (2, 6) float32
        Apparent tilt of the gel under a press; see
        :class:`~tactile_core.algorithms.slopes.press_light.PressLight`. Samples without a slope are
        not under a press.

    References
    ----------
    .. [1] P. J. Huber, "Robust Estimation of a Location Parameter", Annals of Mathematical
       Statistics 35(1), 1964.
    """
    from scipy.optimize import least_squares

    pick = np.random.default_rng(seed).permutation(len(features))[:3_000]  # [pixels] enough
    # Copies with another gain have the same normals: the fit has to be independent of albedo.
    rng = np.random.default_rng(seed)
    # [ratio] A common gain of each copy, so that the fit does not depend on the albedo (ADR 15)
    copies = 1 + 0.03 * rng.standard_normal(len(pick))
    gain = np.concatenate([np.ones(len(pick)), copies])
    pick = np.concatenate([pick, pick])
    change = (features[pick, :-2] + 1.0) * gain[:, None] - 1
    target = normal_xy[pick]
    terms = regression.terms(features[pick, -2:], 2).astype(np.float64)
    lights = change.shape[1]
    logs = np.log(np.maximum(change + 1, LEAST_RATIO))
    start = _linear_start(change, terms, target)
    penalty = np.full(len(start), _RIDGE)
    # Stronger: exponents and directions are correlated over the slopes of a ball (ADR 15)
    penalty[:lights] = 1.0

    pressed = np.asarray(tilted & target.any(axis=1), np.float64)
    found = start
    for rounds in (4, 12):  # [evaluations] at most, before and after the noise is known
        fit = _Objective(logs, terms, target, pressed, start, penalty)
        fit = replace(fit, huber=fit.noise_limit(found))
        found = least_squares(fit.error, found, fit.jacobian, max_nfev=rounds).x
    return _unpack_parameters(found.astype(np.float32), lights)


@dataclass(frozen=True, eq=False)
class _Objective:
    """The objective of the fit and its derivative.

    Attributes
    ----------
    logs : (N, K)
        Logarithms of the ratios to the undeformed gel surface.
    terms : (N, 6)
        Monomials of the position.
    target : (N, 2)
        True normal_xy.
    pressed : (N,)
        1 under a press, 0 elsewhere.
    start, penalty : (P,)
        Start of the parameters, and weight of their distance from it.
    huber : float
        Distance of normal_xy where the loss turns from the square to the root.
    """

    logs: Float
    terms: Float
    target: Float32
    pressed: Float
    start: Float
    penalty: Float
    huber: float = _LEAST_HUBER

    def noise_limit(self, parameters: Float) -> float:
        """Return the distance where the noise ends, from the errors under a press."""
        missed, _, _ = self._residual(*_unpack_parameters(parameters, self.logs.shape[1]))
        sigma = regression.sigma_of(missed[self.target.any(axis=1)].ravel())
        # [sigmas] 95 % efficiency under Gaussian noise [1]_
        return max(_LEAST_HUBER, 1.345 * sigma)

    def error(self, parameters: Float) -> Float:
        """Return (2 N + P,) residuals of normal_xy with Huber's loss, and of the penalty."""
        missed, _, _ = self._residual(*_unpack_parameters(parameters, self.logs.shape[1]))
        missed *= _robust(missed, self.huber)
        return np.concatenate([missed.ravel(), self.penalty * (parameters - self.start)])

    def jacobian(self, parameters: Float) -> Float:
        """Return the (2 N + P, P) derivative of :meth:`error`."""
        field, tilt = _unpack_parameters(parameters, self.logs.shape[1])
        missed, b, power = self._residual(field, tilt)
        count, lights = power.shape
        terms = self.terms[:, :, None] * (power - 1)[:, None, :]
        by = np.zeros((count, 3, len(parameters)))
        across = np.stack([*field.across, np.pad(field.facing, ((0, 3), (0, 0)))])
        by[:, :, :lights] = (self.terms @ across).transpose(1, 0, 2) * (power * self.logs)[:, None]
        for component, wide in enumerate((6, 6, 3)):
            first = lights * (1 + 6 * component)
            by[:, component, first : first + wide * lights] = terms[:, :wide].reshape(count, -1)
        pressed = self.pressed[:, None] * self.terms
        by[:, 0, -12:-6], by[:, 1, -6:] = pressed, pressed
        length = np.linalg.norm(b, axis=0)
        normal = (b / length).T
        by -= normal[:, :, None] * np.einsum("nj,njp->np", normal, by)[:, None]
        normal_xy = by[:, :2] / length[:, None, None]
        factor = _robust(missed, self.huber)
        squared = np.maximum((missed**2).sum(axis=1), self.huber**2)
        along = np.einsum("nj,njp->np", missed, normal_xy) / (2 * squared[:, None])
        normal_xy -= np.where(factor < 1, missed, 0)[:, :, None] * along[:, None]
        normal_xy *= factor[:, :, None]
        return np.concatenate([normal_xy.reshape(2 * count, -1), np.diag(self.penalty)])

    def _residual(self, field: LightField, tilt: Any) -> tuple[Float, Float, Float]:
        """Return (N, 2) residuals of normal_xy, (3, N) unnormalised normals, (N, K) responses."""
        power = np.exp(self.logs * field.exponents)
        across = ((self.terms @ field.across) * (power - 1)).sum(axis=2)
        across = across + self.pressed * (tilt @ self.terms.T)
        facing = 1 + ((self.terms[:, :3] @ field.facing) * (power - 1)).sum(axis=1)
        b = np.concatenate([across, facing[None]])
        return (b[:2] / np.linalg.norm(b, axis=0)).T - self.target, b, power


def _robust(missed: Float, huber: float) -> Float:
    """Return (N, 1) factors that turn squared residuals into Huber's loss."""
    size = np.linalg.norm(missed, axis=1, keepdims=True)
    return np.asarray(1 / np.sqrt(np.maximum(1, size / huber)))


def _linear_start(change: Float, terms: Float, target: Float32) -> Float:
    design = (terms[:, :, None] * change[:, None, :]).reshape(len(terms), -1)
    # [weight per sample] The equations stay regular
    normal = design.T @ design + 1e-4 * len(design) * np.eye(design.shape[1])
    across = np.linalg.solve(normal, design.T @ target)
    lights = change.shape[1]
    return np.concatenate([np.ones(lights), across.T.ravel(), np.zeros(3 * lights + 12)])


def _unpack_parameters(parameters: NDArray[Any], lights: int) -> tuple[LightField, NDArray[Any]]:
    ends = [lights, 13 * lights, 16 * lights]
    exponents, across, facing, tilt = np.split(parameters, ends)
    field = LightField(exponents, across.reshape(2, 6, lights), facing.reshape(3, lights))
    return field, tilt.reshape(2, 6)
