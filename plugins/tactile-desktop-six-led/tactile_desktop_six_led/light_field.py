"""Calibrated photometric stereo: a light field over the image and a response for each light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression

Float32 = NDArray[np.float32]


LEAST_RATIO = 0.01  # Smaller ratios to the reference are raised to this: dark noise dominates them


@dataclass(frozen=True, eq=False)
class LightField:
    """Normals from K lights that are lit one after another.

    Under light k, a matte gel surface has the ratio I_k / I⁰_k of its brightness to that of the
    undeformed surface. An exponent per light linearises the concave response of the light. The K
    ratios are then linear in the normal times the albedo [1]_, with light directions that vary
    over the image. The model is the inverse of this relation:

        b = (0, 0, 1) + M(x, y) · ((I / I⁰) ^ exponent − 1),   normal = b / |b|

    The albedo cancels with the length of b, and so does a change common to all lights.

    Attributes
    ----------
    exponents : (K,) float32
    across : (2, 6, K) float32
        Rows of M for the components along x and y (uphill), quadratic in the position.
    facing : (3, K) float32
        Row of M for the component towards the camera, linear in the position.

    References
    ----------
    .. [1] R. J. Woodham, "Photometric method for determining surface orientation from multiple
       images", Optical Engineering 19(1), 1980.
    .. [2] M. K. Johnson, F. Cole, A. Raj and E. H. Adelson, "Microgeometry capture using an
       elastomeric sensor", ACM Transactions on Graphics 30(4), 2011.
    """

    exponents: Float32
    across: Float32
    facing: Float32

    def __call__(self, features: Float32) -> Float32:
        """Return normal_xy (N, 2) of (N, K + 2) relative changes and positions."""
        change, position = features[:, :-2], features[:, -2:]
        b = self.directions(self.response(change).T, position)
        return np.asarray((b[:2] / np.linalg.norm(b, axis=0)).T, np.float32)

    def response(self, change: Float32) -> Float32:
        """Return (..., K) linear responses relative to the undeformed surface, from changes."""
        ratio = np.maximum(change + 1, LEAST_RATIO)
        return np.asarray(ratio**self.exponents - 1, np.float32)

    def directions(self, response: Float32, position: Float32) -> Float32:
        """Return (3, N) unnormalised normals of (K, N) responses at (N, 2) positions."""
        b = np.einsum("jkn,kn->jn", self.rows(position), response)
        b[2] += 1
        return np.asarray(b, np.float32)

    def rows(self, position: Float32) -> Float32:
        """Return M at (N, 2) positions: (3, K, N)."""
        terms = regression.terms(position, 2).T
        across = self.across.transpose(0, 2, 1) @ terms
        facing = self.facing.T @ terms[: len(self.facing)]
        return np.asarray(np.concatenate([across, facing[None]]), np.float32)
