"""The untouched sensor, guessed from a recording in which something already touches it."""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.regression import terms
from tactile_core.algorithms.arrays.types import Float32

_ROUNDS = 8
_FIRST_ROUNDS = 4
_LEAST_SIGMA = 0.03
"""Of log intensity: the grain of a coating, below which nothing is worth telling apart."""

_SAMPLES_ACROSS = 160


def smooth_background(
    pixels: NDArray[Any], marker_mask: NDArray[np.bool_] | None = None, *, degree: int = 4
) -> Float32:
    """Large-scale light of an image: what level skin would show everywhere.

    A polynomial in the place is fitted to the logarithm of each channel, with Cauchy weights, so
    that relief, whose intensities stand out, counts for next to nothing. Only what varies as slowly
    as the polynomial survives: a shape that fills the image would be taken for light.

    Parameters
    ----------
    pixels : (H, W, K)
        Intensities; most of the skin should be level.
    marker_mask : (H, W) bool, optional
        Pixels that do not show the coating.
    degree : int
        Total degree of the polynomial.

    Returns
    -------
    (H, W, K) float32
        On the scale of ``pixels``, positive.
    """
    height, width, channels = pixels.shape
    step = max(1, min(height, width) // _SAMPLES_ACROSS)
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    powers = terms(np.stack([x.ravel(), y.ravel()], axis=1), degree)
    seen = np.zeros((height, width), bool)
    seen[step // 2 :: step, step // 2 :: step] = True
    if marker_mask is not None:
        seen &= ~marker_mask
    few = powers[seen.ravel()]
    least = max(float(pixels.max()) / 1000, 1e-6)
    planes = []
    for k in range(channels):
        logarithm = np.log(np.maximum(pixels[..., k][seen].astype(np.float64), least))
        planes.append(np.exp(powers @ _cauchy_fit(few, logarithm, degree)))
    return np.stack(planes, axis=1).reshape(pixels.shape).astype(np.float32)


def _cauchy_fit(powers: NDArray[Any], values: NDArray[Any], degree: int) -> NDArray[Any]:
    """Coefficients, one degree after another.

    Each degree starts from the weights of the one below, which is too stiff to follow relief: so
    what stands out there stays out, even near the border.
    """
    weight = np.ones_like(values)
    coefficients: NDArray[Any] = np.zeros(0)
    for highest in range(degree + 1):
        some = powers[:, : comb(highest + 2, 2)]
        for _ in range(_ROUNDS if highest == degree else _FIRST_ROUNDS):
            root = np.sqrt(weight)
            coefficients = np.linalg.lstsq(some * root[:, None], values * root, rcond=None)[0]
            residual = values - some @ coefficients
            sigma = max(_LEAST_SIGMA, sigma_of(residual))
            weight = 1 / (1 + np.square(residual / sigma))
    return coefficients
