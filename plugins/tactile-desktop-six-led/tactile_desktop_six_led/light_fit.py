"""A light field fitted to pixels of known slope."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression
from tactile_desktop_six_led.light_field import DIMMEST, LightField

Float32 = NDArray[np.float32]
Float = NDArray[np.float64]

_SAMPLES = 3_000
_GAIN = 0.03
_ROUNDS = 12
_HUBER = 0.05
_RIDGE = 0.03
_EXPONENT_RIDGE = 1.0
"""Exponents and directions can stand in for each other over the slopes that are pressed."""
_TINY = 1e-4


def fit_light_field(features: Float32, normal_xy: Float32, *, seed: int = 0) -> LightField:
    """Fit response and light field to pixels of known slope.

    The error of the normal is minimised, not that of the intensities: intensities weigh all slopes
    alike and leave a bias in each. Starts from the field that is linear in the change.

    Parameters
    ----------
    features : (N, K + 2) float32
        Relative change of each lamp, and place.
    normal_xy : (N, 2) float32
        Sine of the slope along x and y, uphill.
    seed : int
        Same seed, same sample.

    Returns
    -------
    LightField
    """
    from scipy.optimize import least_squares

    pick = np.random.default_rng(seed).permutation(len(features))[:_SAMPLES]
    # The same pixels a little brighter: their normals are the same, so the albedo must drop out.
    rng = np.random.default_rng(seed)
    gain = np.concatenate([np.ones(len(pick)), 1 + _GAIN * rng.standard_normal(len(pick))])
    pick = np.concatenate([pick, pick])
    change = (features[pick, :-2] + 1.0) * gain[:, None] - 1
    known = normal_xy[pick]
    terms = regression.terms(features[pick, -2:], 2).astype(np.float64)
    lights = change.shape[1]
    logs = np.log(np.maximum(change + 1, DIMMEST))
    start = _linear_start(change, terms, known)
    held = np.full(len(start), _RIDGE)
    held[:lights] = _EXPONENT_RIDGE

    fit = _Objective(logs, terms, known, start, held)
    found = least_squares(fit.error, start, fit.jacobian, max_nfev=_ROUNDS).x
    return _unpacked(found.astype(np.float32), lights)


@dataclass(frozen=True, eq=False)
class _Objective:
    """What the fit minimises, and its derivative.

    Attributes
    ----------
    logs : (N, K)
        Logarithms of the ratios to the untouched skin.
    terms : (N, 6)
        Of the place.
    known : (N, 2)
        Sines.
    start, held : (P,)
        Where the parameters start, and how strongly they are held there.
    """

    logs: Float
    terms: Float
    known: Float32
    start: Float
    held: Float

    def error(self, parameters: Float) -> Float:
        """(2 N + P,) sines missed, beyond Huber's limit by their root, and what was held."""
        missed, _, _ = self._missed(_unpacked(parameters, self.logs.shape[1]))
        missed *= _robust(missed)
        return np.concatenate([missed.ravel(), self.held * (parameters - self.start)])

    def jacobian(self, parameters: Float) -> Float:
        """(2 N + P, P)."""
        field = _unpacked(parameters, self.logs.shape[1])
        missed, b, power = self._missed(field)
        count, lights = power.shape
        terms = self.terms[:, :, None] * (power - 1)[:, None, :]
        by = np.zeros((count, 3, len(parameters)))
        across = np.stack([*field.across, np.pad(field.facing, ((0, 3), (0, 0)))])
        by[:, :, :lights] = (self.terms @ across).transpose(1, 0, 2) * (power * self.logs)[:, None]
        for component, wide in enumerate((6, 6, 3)):
            first = lights * (1 + 6 * component)
            by[:, component, first : first + wide * lights] = terms[:, :wide].reshape(count, -1)
        length = np.linalg.norm(b, axis=0)
        normal = (b / length).T
        by -= normal[:, :, None] * np.einsum("nj,njp->np", normal, by)[:, None]
        normal_xy = by[:, :2] / length[:, None, None]
        factor = _robust(missed)
        squared = np.maximum((missed**2).sum(axis=1), _HUBER**2)
        along = np.einsum("nj,njp->np", missed, normal_xy) / (2 * squared[:, None])
        normal_xy -= np.where(factor < 1, missed, 0)[:, :, None] * along[:, None]
        normal_xy *= factor[:, :, None]
        return np.concatenate([normal_xy.reshape(2 * count, -1), np.diag(self.held)])

    def _missed(self, field: LightField) -> tuple[Float, Float, Float]:
        """(N, 2) sines too much, (3, N) unnormalised normals, (N, K) linear responses."""
        power = np.exp(self.logs * field.exponents)
        across = ((self.terms @ field.across) * (power - 1)).sum(axis=2)
        facing = 1 + ((self.terms[:, :3] @ field.facing) * (power - 1)).sum(axis=1)
        b = np.concatenate([across, facing[None]])
        return (b[:2] / np.linalg.norm(b, axis=0)).T - self.known, b, power


def _robust(missed: Float) -> Float:
    """(N, 1) factors: errors beyond Huber's limit count by their root."""
    size = np.linalg.norm(missed, axis=1, keepdims=True)
    return np.asarray(1 / np.sqrt(np.maximum(1, size / _HUBER)))


def _linear_start(change: Float, terms: Float, known: Float32) -> Float:
    design = (terms[:, :, None] * change[:, None, :]).reshape(len(terms), -1)
    normal = design.T @ design + _TINY * len(design) * np.eye(design.shape[1])
    across = np.linalg.solve(normal, design.T @ known)
    lights = change.shape[1]
    return np.concatenate([np.ones(lights), across.T.ravel(), np.zeros(3 * lights)])


def _unpacked(parameters: NDArray[Any], lights: int) -> LightField:
    exponents, across, facing = np.split(parameters, [lights, 13 * lights])
    return LightField(exponents, across.reshape(2, 6, lights), facing.reshape(3, lights))
