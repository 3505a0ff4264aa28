"""Decode the normal from a change of colour: yaw from hue, pitch from saturation and intensity.

This is the principle of the four-colour fingertip [1]_ [2]_. Lights of different colours illuminate
the gel from different sides. The hue of the change therefore gives the direction in which the
surface tilts, and its strength the angle. Where a tilt turns the surface towards one light as much
as away from the opposite one, the mean intensity barely changes, and the saturation gives the
pitch.

References
----------
.. [1] R. Li, R. Platt, W. Yuan, A. ten Pas, N. Roscup, M. A. Srinivasan and E. H. Adelson,
   "Localization and Manipulation of Small Parts Using GelSight Tactile Sensing", IROS, 2014.
.. [2] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
   Estimating Geometry and Force", Sensors 17(12), 2017, section 4.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression
from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial

Float32 = NDArray[np.float32]

# Rows: two axes of the plane of hue and saturation, and the intensity; orthonormal.
OPPONENT = np.array([[2, -1, -1], [0, 3**0.5, -(3**0.5)], [2**0.5] * 3]) / 6**0.5

_PLACE_ORDER = 2  # [order] Of all polynomials of the position: light of a few LEDs is smooth
# [order] Of the polynomials of normal and colour. With 4, heights of virtual contacts are off by
# 24 µm instead of 17
_ORDER = 5
# [weight] Ridge penalty of what depends on the position. With a tenth, a groove that leaves two
# colours undetermined is 55 instead of 26 % too shallow
_RIDGE = 1e-2


@dataclass(frozen=True, eq=False)
class HueDecoder:
    """Map a change of colour and a position to the normal.

    Attributes
    ----------
    normalisation : (6, 3, 3) float32
        For each monomial of the position, a matrix from the relative change of the channels to two
        chroma axes and the intensity. Its sum maps the change at each position to the average
        change that the same normal causes.
    pitch_and_yaw : PolynomialFit
        Chroma and intensity to the components x and y of the normal. The chroma axes are turned
        and scaled so that, to first order, the hue is the yaw and the saturation the sine of the
        pitch.
    by_place : (6, 3, 2) float32
        What remains at a position: for each monomial, a matrix from chroma and intensity to the
        components of the normal.
    """

    normalisation: Float32
    pitch_and_yaw: PolynomialFit
    by_place: Float32

    def __call__(self, features: Float32) -> Float32:
        """Return normal_xy (N, 2) of (N, 5) relative changes and positions."""
        colour = hue_and_intensity(features, self.normalisation)
        return self.pitch_and_yaw(colour) + at_place(colour, features[:, 3:], self.by_place)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the fitted arrays by name."""
        places = {"normalisation": self.normalisation, "by_place": self.by_place}
        return places | self.pitch_and_yaw.arrays()

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild the decoder; LookupError or ValueError if an array is missing or misshapen."""
        shapes = {"normalisation": (6, 3, 3), "by_place": (6, 3, 2)}
        for name, shape in shapes.items():
            if arrays[name].shape != shape:
                raise ValueError(f"{name} does not fit a decoder")
        return cls(arrays["normalisation"], PolynomialFit.from_arrays(arrays), arrays["by_place"])


def at_place(values: Float32, position: Float32, matrices: Float32) -> Float32:
    """Multiply (N, J) values by a (J, M) matrix that is a polynomial of the (N, 2) position."""
    terms = regression.terms(position, _PLACE_ORDER)
    there = (terms @ matrices.reshape(len(matrices), -1)).reshape(-1, *matrices.shape[1:])
    return np.asarray(np.einsum("nj,njm->nm", values, there), np.float32)


def hue_and_intensity(features: Float32, normalisation: Float32) -> Float32:
    """Return (N, 3) chroma axes and intensity, as they would be under the average light."""
    return at_place(features[:, :3], features[:, 3:], normalisation)


def fit_decoder(
    features: Float32, normal_xy: Float32, *, by_place: bool
) -> tuple[HueDecoder, Float32]:
    """Fit to pixels with ground-truth slopes.

    Parameters
    ----------
    features : (N, 5) float32
        Relative change of the three channels, and position.
    normal_xy : (N, 2) float32
        Components of the normal along x and y, uphill.
    by_place : bool
        Whether to fit what depends on the position. It needs presses all over the view: from a
        dozen single ones it would be extrapolated, and tilt the level gel around them.

    Returns
    -------
    HueDecoder
    tilt : (2, 6) float32
        Apparent tilt of the gel under a press; see
        :class:`~tactile_core.algorithms.slopes.press_light.PressLight`. Samples without a slope are
        not under a press.
    """
    normalisation = _fit_normalisation(features, normal_xy)
    # Turn the axes so that, to first order, hue is yaw and saturation the sine of the pitch.
    chroma = hue_and_intensity(features, normalisation)[:, :2].astype(np.float64)
    onto = np.linalg.lstsq(chroma, normal_xy.astype(np.float64), rcond=None)[0]
    normalisation[:, :, :2] = normalisation[:, :, :2] @ onto
    colour = hue_and_intensity(features, normalisation)
    # ten times the penalty, as in core.polynomial, flattens: other grids of balls have 1.29°
    polynomial = fit_polynomial(colour, normal_xy, order=_ORDER, ridge=1e-3, curvature_only=True)
    terms = len(normalisation)
    if not by_place:
        nothing = np.zeros((terms, 3, 2), np.float32)
        return HueDecoder(normalisation, polynomial, nothing), np.zeros((2, terms), np.float32)
    pressed_colour = np.column_stack([normal_xy.any(axis=1), colour])
    places = _fit_places(pressed_colour, features[:, 3:], normal_xy - polynomial(colour))
    return HueDecoder(normalisation, polynomial, places[:, 1:]), places[:, 0].T


def _fit_normalisation(features: Float32, normal_xy: Float32) -> Float32:
    """Fit the matrices that map the change at a position to the average change of that normal."""
    change = features[:, :3].astype(np.float64)
    slope = regression.terms(normal_xy.astype(np.float64), _ORDER)
    average = slope @ np.linalg.lstsq(slope, change, rcond=None)[0]
    products = _products(change, features[:, 3:])
    normal = products.T @ products
    normal += _RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
    correction = np.linalg.solve(normal, products.T @ (average - change)).reshape(-1, 3, 3)
    correction[0] += np.eye(3)
    return np.asarray(correction @ OPPONENT.T, np.float32)


def _fit_places(values: NDArray[Any], position: Float32, missing: Float32) -> Float32:
    """Fit (6, J, 2) matrices, by the position, from (N, J) values to what is missing, (N, 2)."""
    scale = values.std(axis=0) + 1e-6  # keeps a division regular
    scale[0] = 1  # whether a pixel is pressed
    products = _products(values / scale, position)
    normal = products.T @ products + _RIDGE * len(products) * np.eye(products.shape[1])
    found = np.linalg.solve(normal, products.T @ missing).reshape(-1, len(scale), 2)
    return np.asarray(found / scale[:, None], np.float32)


def _products(values: NDArray[Any], position: Float32) -> NDArray[np.float64]:
    """Multiply (N, J) values by each monomial of their (N, 2) positions, (N, 6 J)."""
    terms = regression.terms(position.astype(np.float64), _PLACE_ORDER)
    return np.asarray((terms[:, :, None] * values[:, None, :]).reshape(len(terms), -1))
