"""The axes of a load cell, faults of its labels, and errors of a fit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.regression import ONE_SIGMA
from tactile_core.algorithms.arrays.types import Bool, Float64, Intp


class CellRotation(NamedTuple):
    """Rotation from the cell's axes to the image's.

    Attributes
    ----------
    matrix : (2, 2) float64
        Times the cell's (fx, fy) gives those along x and y of the image.
    degrees : float
        Angle from the image's x axis to the cell's, from x towards y.
    mirrored : bool
        The cell's axes are of the other hand.
    """

    matrix: Float64
    degrees: float
    mirrored: bool


class ToolOffset(NamedTuple):
    """Position of the cell's torque axis relative to the image centre.

    Attributes
    ----------
    mm : (x, y)
    std_mm : (x, y)
        Standard errors.
    """

    mm: tuple[float, float]
    std_mm: tuple[float, float]

    @property
    def determined(self) -> bool:
        """Whether the offset differs from 0."""
        away = np.abs(self.mm) / np.maximum(self.std_mm, 1e-12)
        return bool(away.max() > 3.0)  # [standard errors] the usual three


def cell_rotation(shift: Float64, shear: Float64, normal: Float64) -> CellRotation | None:
    """Return the rotation that best turns the shear force along the displacement.

    The gel responds alike in every direction, so that the mean displacement has the direction of
    the shear force. It is an orthogonal Procrustes problem [1]_; what follows the normal force is
    subtracted first.

    Parameters
    ----------
    shift : (N, 2) float64
        Mean displacement of the gel surface, mm.
    shear : (N, 2) float64
        Of the cell, N.
    normal : (N,) float64
        Of the cell, N; zeros if it is unknown.

    Returns
    -------
    CellRotation or None
        None if the shear does not determine it.

    References
    ----------
    .. [1] P. H. Schönemann, "A generalized solution of the orthogonal Procrustes problem",
       Psychometrika 31, 1966.
    """
    basis = np.stack([np.ones_like(normal), normal], 1)
    shift, shear = (
        values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0] for values in (shift, shear)
    )
    left, sizes, right = np.linalg.svd(shift.T @ shear)
    norms = np.linalg.norm(shift @ left, axis=0) * np.linalg.norm(shear @ right.T, axis=0)
    # [ratio] Below it shear was not applied along both axes
    if not (sizes > 0.5 * np.maximum(norms, 1e-300)).all():
        return None
    matrix = left @ right
    mirrored = bool(np.linalg.det(matrix) < 0)
    degrees = float(np.degrees(np.arctan2(matrix[1, 0], matrix[0, 0])))
    return CellRotation(matrix, degrees, mirrored)


def tool_offset(moment: Float64, forces: Float64) -> ToolOffset | None:
    """Return where the cell's torque axis is.

    About the cell's axis at (x, y) the torque is ``tz − x fy + y fx``, with tz about the image
    centre, which is proportional to the moment of the displacement about it.

    Parameters
    ----------
    moment : (N,) float64
        Moment of the displacement about the image centre, mm per mm of lever.
    forces : (N, 4) float64
        fx, fy, fz in N along the image's axes and tz in N·mm about the cell's axis.

    Returns
    -------
    ToolOffset or None
        None if the samples do not determine it.
    """
    columns = np.stack([moment, -forces[:, 1], forces[:, 0]], 1)
    scale = np.sqrt((columns**2).mean(0))
    if len(columns) <= 3 or not scale.all():
        return None
    found, rest, rank, _ = np.linalg.lstsq(columns / scale, forces[:, 3], rcond=1e-6)
    if rank < 3:
        return None
    spread = np.linalg.inv(columns.T @ columns) * (float(rest[0]) / (len(columns) - 3))
    (_, x_mm, y_mm), (_, x_std, y_std) = found / scale, np.sqrt(np.diag(spread))
    return ToolOffset((float(x_mm), float(y_mm)), (float(x_std), float(y_std)))


def about_centre(forces: Float64, offset: ToolOffset) -> Float64:
    """Return (N, 4) forces with the torque about the image centre instead of the cell's axis."""
    moved = forces.copy()
    x_mm, y_mm = offset.mm
    moved[:, 3] += x_mm * forces[:, 1] - y_mm * forces[:, 0]
    return moved


def is_clipped(force: Float64) -> bool:
    """Whether readings of one component, in order of time, have a plateau at an extreme.

    A plateau at rest is none: the extreme is on the other side of the middle of the range.
    """
    force = force[np.isfinite(force)]
    span = float(np.ptp(force)) if len(force) else 0.0
    if span == 0:
        return False
    for side in (force, -force):
        if side.max() < span / 2:  # the extreme at rest
            continue
        at_extreme = side >= side.max() - 1e-6 * span  # [share of the range] less than any noise
        if _longest_run(at_extreme) >= 5:  # [equal values in a row] noise repeats none so often
            return True
    return False


def at_rest(features: Float64) -> Bool:
    """(N,) True for the frames whose (N, K) features are small on average."""
    sizes = np.abs(features)
    largest = sizes.max(0)
    shares = sizes[:, largest > 0] / largest[largest > 0]
    if not shares.shape[1]:
        return np.ones(len(features), np.bool_)
    return np.asarray(shares.mean(1) <= 0.05)  # [share of the largest] above noise


def rest_offset(force: Float64, at_rest: Bool) -> float:
    """Return the mean force at rest if it is too large for a cell that was zeroed, else 0."""
    known = at_rest & np.isfinite(force)
    if known.sum() < 3:  # [frames at rest]
        return 0.0
    offset = float(np.median(force[known]))
    largest = float(np.nanmax(np.abs(force - offset)))
    # [share of the largest force] A user would see it in every result
    return offset if 0 < 0.1 * largest < abs(offset) else 0.0


def runs_between_rests(size: Float64) -> Intp:
    """(N,) number of the run that each frame belongs to.

    A run begins where the force comes to rest after a press, so that it contains a whole press.

    Parameters
    ----------
    size : (N,) float64
        Size of the force, in order of time.
    """
    share = size / max(float(size.max(initial=0)), 1e-300)
    runs, number, pressed = np.zeros(len(size), np.intp), 0, False
    for index, here in enumerate(share):
        if pressed and here <= 0.05:  # [share of the largest force]
            number, pressed = number + 1, False
        # [share of the largest force] far above the end, so that noise ends no press
        pressed |= bool(here > 0.3)
        runs[index] = number
    if number and not pressed:
        runs[runs == number] = number - 1  # the rest after the last press
    return runs


def _longest_run(found: Bool) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], found, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


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
    # [share of the largest error] Even a perfect fit has a standard deviation
    floor = (1e-3 * float(np.sqrt(squares.max()))) ** 2
    if floor == 0:
        return ForceError(0.0, 0.0)
    columns = np.stack([np.ones_like(load), load**2], 1)
    found = np.array([squares.mean(), 0.0])
    for _ in range(4):  # [reweightings] the third changes nothing
        weights = 1 / np.maximum(columns @ found, floor)
        found, _ = nnls(columns * weights[:, None], squares * weights)
    found[0] = max(found[0], floor)
    ratios = np.abs(errors) / np.sqrt(columns @ found)
    rest, share = np.sqrt(found) * np.quantile(ratios, ONE_SIGMA)
    return ForceError(float(rest), float(share))
