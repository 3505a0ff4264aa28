"""Calibrated photometric stereo: a light field over the image, and each lamp's own response."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression

Float32 = NDArray[np.float32]

DIMMEST = 0.01
"""Smallest ratio to the untouched sensor that is told from darkness."""


@dataclass(frozen=True, eq=False)
class LightField:
    """Normals from K lamps that shine one after another.

    A matte skin under lamp k has the brightness ratio I_k / I⁰_k to its untouched state. Raised to
    an exponent of the lamp's own, which undoes its concave response, the K ratios are linear in the
    normal times the albedo (Woodham 1980), with lamp directions that vary over the image. Inverted:

        b = (0, 0, 1) + M(x, y) · ((I / I⁰) ^ exponent − 1),   normal = b / |b|

    The albedo drops out with the length of b, and so does what brightens all lamps alike.

    Attributes
    ----------
    exponents : (K,) float32
    across : (2, 6, K) float32
        Rows of M for the components along x and y (uphill), quadratic in the place.
    facing : (3, K) float32
        Row of M for the component towards the camera, linear in the place.
    """

    exponents: Float32
    across: Float32
    facing: Float32

    def __call__(self, features: Float32) -> Float32:
        """(N, 2) sines from (N, K + 2) relative changes and place."""
        change, spot = features[:, :-2], features[:, -2:]
        b = self.directions(self.response(change).T, spot)
        return np.asarray((b[:2] / np.linalg.norm(b, axis=0)).T, np.float32)

    def response(self, change: Float32) -> Float32:
        """(..., K) linear responses minus those of the untouched skin, from relative changes."""
        return np.asarray(np.maximum(change + 1, DIMMEST) ** self.exponents - 1, np.float32)

    def directions(self, response: Float32, spot: Float32) -> Float32:
        """(3, N) unnormalised normals from (K, N) responses at (N, 2) places."""
        b = np.einsum("jkn,kn->jn", self.rows(spot), response)
        b[2] += 1
        return np.asarray(b, np.float32)

    def rows(self, spot: Float32) -> Float32:
        """M at (N, 2) places: (3, K, N)."""
        terms = regression.terms(spot, 2).T
        across = self.across.transpose(0, 2, 1) @ terms
        facing = self.facing.T @ terms[: len(self.facing)]
        return np.asarray(np.concatenate([across, facing[None]]), np.float32)

    def along_columns(self, x: Float32) -> Float32:
        """M along columns at (W,) places x, as (K, 3, 3, W) coefficients of 1, y and y²."""
        one, zero = np.ones_like(x), np.zeros_like(x)
        terms = np.array([[one, x, zero, x * x, zero, zero], [zero, zero, one, zero, x, zero]])
        terms = np.concatenate([terms, np.zeros_like(terms[:1])])
        terms[2, 5] = one
        facing = np.concatenate([self.facing, np.zeros_like(self.facing)])
        both = np.concatenate([self.across, facing[None]])
        powers = np.einsum("jtk,ptw->kjpw", both, terms)
        return np.ascontiguousarray(powers, np.float32)
