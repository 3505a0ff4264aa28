"""Rejection of shadows and highlights by the redundancy of four or more lights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Redundancy:
    """The K − 3 combinations of linear responses that vanish on a matte gel surface.

    A cast shadow or a highlight changes the response of one light, so that the combinations no
    longer vanish. The light whose removal reduces the residual most is rejected. The prediction of
    the other lights replaces its response, which is equivalent to least squares without that light.

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
        """Replace the response of the light whose removal reduces the residual most.

        Parameters
        ----------
        response : (K, N) float32

        Returns
        -------
        corrected : (K, N) float32
            Unchanged with four lights, of which no three can show which one is wrong.
        consistent : (N,) bool
            Pixels whose residual is now within the tolerance.
        """
        corrected = response.copy()
        if len(self.combinations) > 1:
            along = self.combinations.T @ (self.combinations @ response)
            length = np.maximum((self.combinations**2).sum(0), 1e-6)  # keeps a division regular
            light = np.argmax(along * along / length[:, None], axis=0)
            pixel = np.arange(len(light))
            corrected[light, pixel] -= along[light, pixel] / length[light]
        return corrected, self.misfit(corrected) <= self.tolerance


def fit_redundancy(response: Float32) -> Redundancy:
    """Fit the combinations that vanish on (K, N) responses of calibration presses.

    They are the singular vectors of the smallest singular values. Steep flanks of a ball are in the
    shadow of some light. Each round therefore keeps the pixels with the smallest residuals.
    """
    kept = response
    for _ in range(5):  # the pixels that are kept change little after that
        directions, _, _ = np.linalg.svd(kept, full_matrices=False)
        # Three lights determine normal and albedo
        vanishing = np.ascontiguousarray(directions[:, 3:].T, np.float32)
        misfit = Redundancy(vanishing, np.inf).misfit(response)
        largest = float(np.quantile(misfit, 0.8))  # steep flanks are a fifth of a ball
        kept = response[:, misfit <= largest]
    return Redundancy(vanishing, 3 * largest)  # shadows are far beyond the noise of level pixels
