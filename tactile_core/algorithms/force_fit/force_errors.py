"""Standard deviation of a force, from its errors on held-out sequences."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64


class FORCE_ERRORS:
    """Parameters of the fit. Nothing sets them from outside."""

    # [share] Share of the errors that are smaller than one standard deviation. Source:
    # definition: of normal errors, 68.27 %.
    within = 0.6827
    rounds = 4  # [count] Rounds of reweighting. Source: by hand, the third changes nothing.
    # [share of the largest error] Least standard deviation. Source: by hand, : a perfect fit has
    # no standard deviation of zero, which nothing could be compared with.
    least = 1e-3


class ForceError(NamedTuple):
    """Standard deviation against the size of the load: ``√(rest² + (share · load)²)``.

    Attributes
    ----------
    rest : float
        At rest, N or N·mm.
    share : float
        Growth with the load.
    """

    rest: float
    share: float

    def std(self, load: Float64) -> Float64:
        """(N,) standard deviations at (N,) sizes of the load."""
        return np.asarray(np.hypot(self.rest, self.share * load))


def fitted_error(errors: Float64, load: Float64) -> ForceError:
    """Fit the standard deviation of held-out errors.

    Both variances are non-negative. They are fitted with weights, because a squared error scatters
    as much as it is large, and then scaled so that the right share of errors lies within.

    Parameters
    ----------
    errors : (N,) float64
        Prediction minus truth.
    load : (N,) float64
        Size of the predicted load, N.
    """
    from scipy.optimize import nnls

    squares = errors**2
    floor = (FORCE_ERRORS.least * float(np.sqrt(squares.max()))) ** 2
    if floor == 0:
        return ForceError(0.0, 0.0)
    columns = np.stack([np.ones_like(load), load**2], 1)
    found = np.array([squares.mean(), 0.0])
    for _ in range(FORCE_ERRORS.rounds):
        weights = 1 / np.maximum(columns @ found, floor)
        found, _ = nnls(columns * weights[:, None], squares * weights)
    found[0] = max(found[0], floor)
    ratios = np.abs(errors) / np.sqrt(columns @ found)
    rest, share = np.sqrt(found) * np.quantile(ratios, FORCE_ERRORS.within)
    return ForceError(float(rest), float(share))
