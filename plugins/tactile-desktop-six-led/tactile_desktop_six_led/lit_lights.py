"""Slopes beyond the calibrated ones, from the lights that still reach the gel surface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

_NORMAL = 3  # Unknowns of a normal times an albedo: the fewest lights that determine it


# [count] The darkest lights, at most so many, are left out: half of six lights around the gel are
# behind a steep wall
_MOST_DARK = 3
# [share] A light is dark if its response is within this share of the range from the floor to the
# undeformed gel: width of the half-shadow on virtual units; 0.1 to 0.25 are alike
_DARK_SHARE = 0.15


@dataclass(frozen=True, eq=False)
class LitLights:
    """Normals from the lights that are not behind the surface.

    Where a wall turns away from a light, its response stays at a floor, and a model of all lights
    levels off. The responses of the other lights remain linear in the normal [1]_, for every slope:

        normal_xy = M_S(x, y) · r_S,   S the set of lit lights

    Attributes
    ----------
    floors : (K,) float32
        Response of each light to a surface that faces away from it.
    sets : (S, K) bool
        Sets of lit lights.
    rows : (S, 2, 3, K) float32
        M_S for the components along x and y (uphill), linear in the position; 0 for dark lights.
    begins : float
        Length of normal_xy from which this model replaces the light field; infinite if the light
        field is better on all calibrated slopes.
    shaded : float
        Length of normal_xy from which calibration pixels turn away from a light. Gentler slopes
        with a dark light lie in a cast shadow.

    References
    ----------
    .. [1] R. J. Woodham, "Photometric method for determining surface orientation from multiple
       images", Optical Engineering 19(1), 1980.
    """

    floors: Float32
    sets: Bool
    rows: Float32
    begins: float
    shaded: float

    def __call__(self, response: Float32, position: Float32) -> Float32:
        """Return normal_xy (2, N) of (K, N) responses at (N, 2) positions."""
        terms = regression.terms(position, 1).T
        number = self._set_of(response)
        result = np.empty((2, len(number)), np.float32)
        for s in np.unique(number):
            at = number == s
            result[:, at] = np.einsum(
                "jtk,tn,kn->jn", self.rows[s], terms[:, at], response[:, at], optimize=True
            )
        return result

    def beyond(self, fitted: Float32, response: Float32, position: Float32) -> Float32:
        """Return normal_xy (2, N): the light field's, or this model's where that one fails.

        That is where a light is dark, on walls steeper than the calibration and in cast shadows.
        """
        own = self(response, position)
        length = np.linalg.norm(own, axis=0)
        # from where it begins to where it takes over, a tenth steeper: no step in the slopes
        share = np.clip((length / self.begins - 1) / 0.1, 0, 1)
        share[length < self.shaded] = 1
        share = np.where(self.find_lit(response).all(axis=0), 0, share).astype(np.float32)
        return np.asarray(fitted + share * (own - fitted), np.float32)

    @property
    def dark_below(self) -> Float32:
        """(K,) responses below which a light is dark."""
        return np.float32(1 - _DARK_SHARE) * self.floors

    def find_lit(self, response: Float32) -> Bool:
        """Return (K, N): which lights reach the surface."""
        dark = response < self.dark_below[:, None]
        most = min(_MOST_DARK, len(response) - _NORMAL)
        rank = np.argsort(np.argsort(response, axis=0), axis=0)
        return np.asarray(~(dark & (rank < most)))

    def _set_of(self, response: Float32) -> NDArray[np.intp]:
        bits = 1 << np.arange(len(self.floors), dtype=np.int64)
        codes = self.sets @ bits
        order = np.argsort(codes)
        return np.asarray(order[np.searchsorted(codes[order], bits @ self.find_lit(response))])


def fit_lit_lights(
    response: Float32, position: Float32, normal_xy: Float32, fitted: Float32
) -> LitLights:
    """Fit a linear model for each set of lit lights.

    It takes over at the steepness from which it has the smaller error on the calibration's own
    pixels, if there is one.

    Parameters
    ----------
    response : (K, N) float32
        Linear responses of calibration pixels.
    position : (N, 2) float32
    normal_xy, fitted : (N, 2) float32
        The true components of the normal, and those of the light field.
    """
    lights = len(response)
    # [share] above single pixels of noise
    floors = np.quantile(response, 0.005, axis=1).astype(np.float32)
    most = min(_MOST_DARK, lights - _NORMAL)
    dark = [set(some) for n in range(most + 1) for some in combinations(range(lights), n)]
    sets = np.array([[k not in some for k in range(lights)] for some in dark])
    terms = regression.terms(position, 1).astype(np.float64)
    rows = np.zeros((len(sets), 2, terms.shape[1], lights), np.float32)
    bright = response >= ((1 - _DARK_SHARE) * floors)[:, None]
    for number, lit in enumerate(sets):
        seen = bright[lit].all(axis=0)
        design = (terms[seen][:, :, None] * response[lit][:, seen].T[:, None, :]).reshape(
            np.count_nonzero(seen), terms.shape[1] * np.count_nonzero(lit)
        )
        # a set that no calibration pixel shows gets zeros
        weight = 1e-4 * max(1, len(design))  # [weight per sample] the equations stay regular
        normal = design.T @ design + weight * np.eye(design.shape[1])
        found = np.linalg.solve(normal, design.T @ normal_xy[seen])
        rows[number][:, :, lit] = found.T.reshape(2, terms.shape[1], -1)
    dark_at = np.linalg.norm(normal_xy[~bright.all(axis=0)], axis=1)
    # [ratio] Gentler slopes do not turn away: noise and the half-shadow on virtual units; 0.6 to
    # 0.75 are alike
    shaded = float(np.median(dark_at)) * 0.7 if len(dark_at) else 0.0
    model = LitLights(floors, sets, rows, np.inf, shaded)
    own = model(response, position).T
    return replace(model, begins=_begins(normal_xy, fitted, own))


def _begins(normal_xy: Float32, fitted: Float32, own: Float32) -> float:
    """Return the steepness at which changing from one model to the other errs least."""
    steep = np.linalg.norm(normal_xy, axis=1)
    wrong = [np.linalg.norm(model - normal_xy, axis=1) for model in (fitted, own)]
    limits = np.linspace(0.5, 1, 20) * steep.max()  # [levels] finer than what the result depends on
    total = [wrong[0][steep < limit].sum() + wrong[1][steep >= limit].sum() for limit in limits]
    best = int(np.argmin(total))
    if total[best] < 0.99 * wrong[0].sum():  # [share] a smaller gain is chance
        return float(limits[best])
    return np.inf
