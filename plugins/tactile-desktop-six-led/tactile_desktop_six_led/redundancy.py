"""Shadows and highlights: what one lamp says and the others do not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

_NORMAL = 3
"""A normal times an albedo: as many lamps are needed, the rest are redundant."""

_MOST_SPOILT = 2
_ROUNDS = 5
_CONSISTENT = 0.8
_MARGIN = 4.0


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

    def mended(self, response: Float32) -> tuple[Float32, Bool]:
        """(K, N) responses with spoilt lamps replaced, and (N,) bool: which are consistent now."""
        mended = response.copy()
        lamps, redundant = len(response), len(self.combinations)
        for spoilt in range(1, min(_MOST_SPOILT, redundant - 1) + 1):
            bad = np.flatnonzero(self.misfit(mended) > self.tolerance)
            if not len(bad):
                break
            left = self.combinations @ response[:, bad]
            best = np.full(len(bad), np.inf, np.float32)
            for guess in combinations(range(lamps), spoilt):
                columns = self.combinations[:, guess]
                change = np.linalg.pinv(columns) @ left
                missing = left - columns @ change
                rest = np.einsum("cn,cn->n", missing, missing)
                better = np.flatnonzero(rest < best)
                best[better] = rest[better]
                mended[:, bad[better]] = response[:, bad[better]]
                mended[np.ix_(list(guess), bad[better])] -= change[:, better]
        return mended, self.misfit(mended) <= self.tolerance

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What :meth:`from_arrays` takes, by name."""
        return {"combinations": self.combinations, "tolerance": np.array(self.tolerance)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild from arrays; a missing one is a KeyError."""
        return cls(arrays["combinations"], float(arrays["tolerance"]))


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
