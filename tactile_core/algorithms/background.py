"""Reference image estimated from a recording in which something already touches the sensor."""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.regression import terms
from tactile_core.algorithms.arrays.types import Float32


class BACKGROUND:
    """Parameters of the background fit. What a user may choose is the degree of the polynomial."""

    # [count] Samples along the shorter side of the image; more add time and no accuracy.
    samples_across = 160
    # [count] Reweightings at the final degree, and at each degree below it.
    rounds = 8
    first_rounds = 4
    # [logarithm of intensity] Smallest residual scale of the Cauchy weights: the noise of the
    # coating. Source: chosen on the six-LED groove recording, where widths of 0.01 to 0.1 give
    # the same heights (ADR 14).
    least_sigma = 0.03


def smooth_background(
    pixels: NDArray[Any], marker_mask: NDArray[np.bool_] | None = None, *, degree: int = 4
) -> Float32:
    """Estimate the illumination of a flat, undeformed gel surface from an image with relief.

    Fits a polynomial of the position to the logarithm of each channel by iteratively reweighted
    least squares with Cauchy weights [1]_, so that relief has almost no weight. The result keeps
    only what varies as slowly as the polynomial: a shape that fills the image is mistaken for
    illumination.

    Parameters
    ----------
    pixels : (H, W, K)
        Intensities; most of the gel surface should be flat.
    marker_mask : (H, W) bool, optional
        Pixels that do not show the coating.
    degree : int
        Total degree of the polynomial.

    Returns
    -------
    (H, W, K) float32
        In the units of ``pixels``, positive.

    References
    ----------
    .. [1] P. W. Holland and R. E. Welsch, "Robust regression using iteratively reweighted
       least-squares", Communications in Statistics – Theory and Methods 6(9), 1977.
    """
    height, width, channels = pixels.shape
    step = max(1, min(height, width) // BACKGROUND.samples_across)
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    powers = terms(np.stack([x.ravel(), y.ravel()], axis=1), degree)
    seen = np.zeros((height, width), bool)
    seen[step // 2 :: step, step // 2 :: step] = True
    if marker_mask is not None:
        seen &= ~marker_mask
    sampled = powers[seen.ravel()]
    least = max(float(pixels.max()) / 1000, 1e-6)
    planes = []
    for k in range(channels):
        logarithm = np.log(np.maximum(pixels[..., k][seen].astype(np.float64), least))
        planes.append(np.exp(powers @ _cauchy_fit(sampled, logarithm, degree)))
    return np.stack(planes, axis=1).reshape(pixels.shape).astype(np.float32)


def _cauchy_fit(powers: NDArray[Any], values: NDArray[Any], degree: int) -> NDArray[Any]:
    """Fit the coefficients, one degree after another.

    Each degree starts from the weights of the one below. A low degree is too stiff to follow
    relief, so its outliers stay outliers, even near the border.
    """
    weight = np.ones_like(values)
    coefficients: NDArray[Any] = np.zeros(0)
    for highest in range(degree + 1):
        lower = powers[:, : comb(highest + 2, 2)]
        for _ in range(BACKGROUND.rounds if highest == degree else BACKGROUND.first_rounds):
            root = np.sqrt(weight)
            coefficients = np.linalg.lstsq(lower * root[:, None], values * root, rcond=None)[0]
            residual = values - lower @ coefficients
            sigma = max(BACKGROUND.least_sigma, sigma_of(residual))
            weight = 1 / (1 + np.square(residual / sigma))
    return coefficients
