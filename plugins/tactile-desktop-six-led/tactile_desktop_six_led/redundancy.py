"""Shadows and highlights: what one lamp says and the others do not."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

_NORMAL = 3
"""A normal times an albedo: as many lamps are needed, the rest are redundant."""

_TINY = 1e-6
_ROUNDS = 5
_CONSISTENT = 0.8
_MARGIN = 3.0


@dataclass(frozen=True, eq=False)
class Redundancy:
    """The K − 3 combinations of linear responses that vanish on the calibrated skin.

    A cast shadow or a highlight changes one lamp, sometimes two, and breaks them. The lamp without
    which the others agree best is rejected and its response replaced by the one that they predict,
    which is least squares without that lamp; two lamps where one does not explain it, if four
    remain.

    Attributes
    ----------
    combinations : (K − 3, K) float32
        Orthonormal rows.
    tolerance : float
        Length of what is left of them up to which a pixel is consistent.
    """

    combinations: Float32
    tolerance: float

    def misfit(self, response: Float32) -> Float32:
        """(N,) how far (K, N) responses are from consistent."""
        left = self.combinations @ response
        return np.asarray(np.sqrt(np.einsum("cn,cn->n", left, left)), np.float32)

    def corrected(self, response: Float32) -> tuple[Float32, Bool]:
        """(K, N) responses with spoilt lamps replaced, and (N,) bool: which are consistent now."""
        redundant = len(self.combinations)
        corrected = self._without_one(response) if redundant > 1 else response.copy()
        bad = np.flatnonzero(self.misfit(corrected) > self.tolerance)
        if redundant > 2 and len(bad):
            corrected[:, bad] = self._without_two(response[:, bad])
            bad = bad[self.misfit(corrected[:, bad]) > self.tolerance]
        sure = np.ones(response.shape[1], np.bool_)
        sure[bad] = False
        return corrected, sure

    def _without_one(self, response: Float32) -> Float32:
        """(K, N) responses in which the lamp is replaced that mends most."""
        along = self.combinations.T @ (self.combinations @ response)
        length = np.maximum((self.combinations**2).sum(0), _TINY)
        light = np.argmax(along * along / length[:, None], axis=0)
        pixel = np.arange(len(light))
        corrected = response.copy()
        corrected[light, pixel] -= along[light, pixel] / length[light]
        return corrected

    def _without_two(self, response: Float32) -> Float32:
        """(K, N) responses in which the two lamps are replaced that mend most."""
        lights, projections, replacements = self._pairs
        left = self.combinations @ response
        # What is left shrinks by its projection onto the span of the two lamps.
        best = np.argmax(((projections @ left) ** 2).sum(axis=1), axis=0)
        change = np.einsum("nlc,cn->ln", replacements[best], left)
        corrected = response.copy()
        corrected[lights[best].T, np.arange(len(best))] -= change
        return corrected

    @cached_property
    def _pairs(self) -> tuple[NDArray[np.intp], Float32, Float32]:
        """All P pairs of lamps, (P, 2): basis of their span and pseudo-inverse, (P, 2, K − 3)."""
        lights = np.array(list(combinations(range(self.combinations.shape[1]), 2)))
        spans = self.combinations.T[lights].transpose(0, 2, 1)
        bases = np.linalg.qr(spans)[0].transpose(0, 2, 1)
        return lights, np.ascontiguousarray(bases), np.linalg.pinv(spans)


def fit_redundancy(response: Float32) -> Redundancy:
    """Find the combinations that vanish on (K, N) responses of a calibrated skin.

    Steep flanks of a ball lie in the shadow of some lamp, which the most consistent pixels are free
    of: the others are left out, round by round.
    """
    kept = response
    for _ in range(_ROUNDS):
        directions, _, _ = np.linalg.svd(kept, full_matrices=False)
        vanishing = np.ascontiguousarray(directions[:, _NORMAL:].T, np.float32)
        misfit = Redundancy(vanishing, np.inf).misfit(response)
        usual = float(np.quantile(misfit, _CONSISTENT))
        kept = response[:, misfit <= usual]
    return Redundancy(vanishing, _MARGIN * usual)
