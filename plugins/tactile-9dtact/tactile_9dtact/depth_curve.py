"""The curve of depth over darkening, fitted to balls whose depth is not known.

How the ratio q of frame to reference depends on the depth is known at two limits. A layer that
absorbs has −log q ∝ depth (Lambert and Beer), a thin layer that scatters 1 − q ∝ depth. The
darkening s = 2 (1 − √q) is the law between them: to second order the first is s + s²/4 and the
second s − s²/4. So the depth is a s + b s², where b is expected within ± a/4, and the presses
decide as far as they determine it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import CalibrationError
from tactile_core.quantities import Float32

Float64 = NDArray[np.float64]

_BINS = 16  # [count] Of the darkening; a ball shows each in a ring of some hundred pixels
_BEND = 0.25  # [ratio] Expected b / a, between the limits of absorption and of scattering
# [ratio] Of the residual to the deviation of the heights. Source: 0.07 on a real ball and at most
# 0.05 on virtual ones; 0.5 and 0.8 on a flat end and a bar
_MOST_UNLIKE = 0.3


@dataclass(frozen=True, eq=False)
class DepthCurve:
    """Depth by darkening, linear between nodes.

    Attributes
    ----------
    darkening : (M,) float32
        Increasing; see :func:`~tactile_9dtact.darkness.darkening`.
    depth_mm : (M,) float32
        Negative where the image is brighter: gel that is pressed away bulges elsewhere.
    std_mm : (M,) float32
        Deviation of the depth on the balls of the fit.
    """

    darkening: Float32
    depth_mm: Float32
    std_mm: Float32

    def __post_init__(self) -> None:
        """Check that it is a curve; ValueError if not."""
        table = np.stack([self.darkening, self.depth_mm, self.std_mm])
        if table.ndim != 2 or not np.isfinite(table).all() or (np.diff(table[0]) <= 0).any():
            raise ValueError("the nodes of a curve increase")


@dataclass(frozen=True, eq=False)
class Contact:
    """Pixels on one ball.

    Attributes
    ----------
    s : (N,) float64
        Darkening.
    slopes : (N, 2) float64
        True slopes.
    mm : (N,) float64
        True height, up to a constant.
    name : str
        Name of the press, for messages.
    """

    s: Float64
    slopes: Float64
    mm: Float64
    name: str = ""

    @property
    def nuisances(self) -> Float64:
        """(N, 3) change of the height by its unknown level and a displacement along x and y."""
        return np.column_stack([np.ones(len(self.s)), self.slopes])


def fit_curve(contacts: Sequence[Contact]) -> DepthCurve:
    """Fit the depth by least squares, with the level and the displacement of each contact.

    First a s + b s². What it does not know – the ball is seen in perspective, and light scatters
    sideways – is alike over a whole contact. So each contact counts as one observation against the
    expected bend; its variance is estimated from the residuals, in some rounds. Then the mean
    residual of each bin of the darkening corrects the curve, where the balls have darkened it.

    Parameters
    ----------
    contacts : sequence of Contact
        At least one.

    Raises
    ------
    CalibrationError
        The image does not darken with depth, or in some contact not as on a ball.
    """
    unknowns = 2 + 3 * len(contacts)
    normal, right = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
    for number, contact in enumerate(contacts):
        columns = np.zeros((len(contact.s), unknowns))
        columns[:, 0], columns[:, 1] = contact.s, contact.s**2
        columns[:, _own(number)] = contact.nuisances
        normal += columns.T @ columns / len(contact.s)
        right += columns.T @ contact.mm / len(contact.s)
    normal += 1e-9 * np.eye(unknowns)  # slopes in a single direction leave a displacement open
    variance, a, b, errors = np.inf, 1.0, 0.0, list[Float64]()
    for _ in range(6):  # [count] rounds, from a straight line on; they converge in four
        expected = np.zeros((unknowns, unknowns))
        expected[1, 1] = min(variance / (a * _BEND) ** 2, 1e9)
        solved = np.linalg.solve(normal + expected, right)
        a, b = float(solved[0]), float(solved[1])
        if a <= 0:
            raise CalibrationError(
                "the image does not darken where the ball presses; exchange --presses and "
                "--reference if they are mixed up, or take a model for light from the sides, as "
                "--model core.automatic"
            )
        errors = [
            contact.s * (a + b * contact.s) + contact.nuisances @ solved[_own(k)] - contact.mm
            for k, contact in enumerate(contacts)
        ]
        variance = float(np.mean([np.mean(error**2) for error in errors]))
    for contact, error in zip(contacts, errors, strict=True):
        if float(np.std(error)) > _MOST_UNLIKE * float(np.std(contact.mm)):
            raise CalibrationError(
                f"{contact.name or 'a press'} does not darken like a ball of this diameter; "
                "replace it by a press of the ball alone, or correct the diameter"
            )
    return _corrected(a, b, np.concatenate([c.s for c in contacts]), np.concatenate(errors))


def _own(number: int) -> slice:
    """Return where the unknowns of a contact are, its level and displacement."""
    return slice(2 + 3 * number, 5 + 3 * number)


def _corrected(a: float, b: float, s: Float64, error: Float64) -> DepthCurve:
    """Return the curve less its mean error in bins of the darkening.

    A bin without pixels has no node. Beyond the bins the slope is that of a s + b s² there.
    """
    edges = np.linspace(s.min(), s.max(), _BINS + 1)
    which = np.clip(np.searchsorted(edges, s, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(which, minlength=_BINS)
    some = count > 0
    middle, bias, square = (
        np.bincount(which, values, _BINS)[some] / count[some] for values in (s, error, error**2)
    )
    mm = np.maximum.accumulate(np.maximum(middle * (a + b * middle) - bias, 0))
    std_mm = np.sqrt(square)
    # a quarter brighter than the reference, the reference, and black
    ends = mm[-1] + (2 - middle[-1]) * max(a + 2 * b * middle[-1], 0)
    keep = middle > 0
    nodes = np.concatenate([[-0.25, 0], middle[keep], [2]])
    depth_mm = np.concatenate([[-0.25 * a, 0], mm[keep], [ends]])
    spread_mm = np.concatenate([std_mm[:1], std_mm[:1], std_mm[keep], std_mm[-1:]])
    return DepthCurve(*(part.astype(np.float32) for part in (nodes, depth_mm, spread_mm)))
