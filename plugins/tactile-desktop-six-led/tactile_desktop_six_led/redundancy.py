"""Rejection of shadows and highlights by the redundancy of four or more lights."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

_NORMAL = 3  # Unknowns of a normal times an albedo; further lights are redundant

_TINY = 1e-6  # Keeps a denominator regular


class REDUNDANCY:
    """Parameters of fitting the redundancy.

    Nothing sets them: they are relative to the residual.
    """

    rounds = 5  # [count] Fits, each to the consistent pixels of the one before
    # [share] Share of the training pixels with the smallest residuals that count as consistent.
    consistent_share = 0.8
    # [ratio] Tolerance relative to the largest residual of the consistent pixels.
    tolerance_ratio = 3.0


@dataclass(frozen=True, eq=False)
class Redundancy:
    """The K − 3 combinations of linear responses that vanish on a matte gel surface.

    A cast shadow or a highlight changes the response of one light, sometimes of two, so that the
    combinations no longer vanish. The light whose removal reduces the residual most is rejected.
    The prediction of the other lights replaces its response, which is equivalent to least squares
    without that light. If one light does not explain the residual and four others remain, two
    lights are replaced.

    Attributes
    ----------
    combinations : (K − 3, K) float32
        Orthonormal rows.
    tolerance : float
        Largest norm of the residual of a consistent pixel.
    """

    combinations: Float32
    tolerance: float

    def misfit(self, response: Float32) -> Float32:
        """Return the (N,) norms of the residuals of (K, N) responses."""
        residual = self.combinations @ response
        return np.asarray(np.sqrt(np.einsum("cn,cn->n", residual, residual)), np.float32)

    def correct_response(self, response: Float32) -> tuple[Float32, Bool]:
        """Replace the responses of outlier lights.

        Parameters
        ----------
        response : (K, N) float32

        Returns
        -------
        corrected : (K, N) float32
        consistent : (N,) bool
            Pixels whose residual is now within the tolerance.
        """
        redundant = len(self.combinations)
        corrected = self._without_one(response) if redundant > 1 else response.copy()
        outlier = np.flatnonzero(self.misfit(corrected) > self.tolerance)
        if redundant > 2 and len(outlier):
            corrected[:, outlier] = self._without_two(response[:, outlier])
            outlier = outlier[self.misfit(corrected[:, outlier]) > self.tolerance]
        consistent = np.ones(response.shape[1], np.bool_)
        consistent[outlier] = False
        return corrected, consistent

    def _without_one(self, response: Float32) -> Float32:
        """Return (K, N) responses with the light replaced that reduces the residual most."""
        along = self.combinations.T @ (self.combinations @ response)
        length = np.maximum((self.combinations**2).sum(0), _TINY)
        light = np.argmax(along * along / length[:, None], axis=0)
        pixel = np.arange(len(light))
        corrected = response.copy()
        corrected[light, pixel] -= along[light, pixel] / length[light]
        return corrected

    def _without_two(self, response: Float32) -> Float32:
        """Return (K, N) responses with the two lights replaced that reduce the residual most."""
        lights, projections, replacements = self._pairs
        residual = self.combinations @ response
        # The residual shrinks by its projection onto the span of the two lights.
        best = np.argmax(((projections @ residual) ** 2).sum(axis=1), axis=0)
        change = np.einsum("nlc,cn->ln", replacements[best], residual)
        corrected = response.copy()
        corrected[lights[best].T, np.arange(len(best))] -= change
        return corrected

    @cached_property
    def _pairs(self) -> tuple[NDArray[np.intp], Float32, Float32]:
        """All P pairs of lights (P, 2), bases of their spans and pseudo-inverses (P, 2, K − 3)."""
        lights = np.array(list(combinations(range(self.combinations.shape[1]), 2)))
        spans = self.combinations.T[lights].transpose(0, 2, 1)
        bases = np.linalg.qr(spans)[0].transpose(0, 2, 1)
        return lights, np.ascontiguousarray(bases), np.linalg.pinv(spans)


def fit_redundancy(response: Float32) -> Redundancy:
    """Fit the combinations that vanish on (K, N) responses of calibration presses.

    They are the singular vectors of the smallest singular values. Steep flanks of a ball are in the
    shadow of some light. Each round therefore keeps the pixels with the smallest residuals.
    """
    kept = response
    for _ in range(REDUNDANCY.rounds):
        directions, _, _ = np.linalg.svd(kept, full_matrices=False)
        vanishing = np.ascontiguousarray(directions[:, _NORMAL:].T, np.float32)
        misfit = Redundancy(vanishing, np.inf).misfit(response)
        largest = float(np.quantile(misfit, REDUNDANCY.consistent_share))
        kept = response[:, misfit <= largest]
    return Redundancy(vanishing, REDUNDANCY.tolerance_ratio * largest)
