"""The axes of a load cell, faults of its labels, and errors of a fit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float64, Intp

# [ratio] Least correlation of the shear force with the displacement, in the weaker direction: below
# it shear was not applied along both axes
_LEAST_CORRELATION = 0.5
# [standard deviations] The position of the axis is determined if it is this many times its standard
# error: the usual three
_SIGMAS = 3.0


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
        return bool(away.max() > _SIGMAS)


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
    if not (sizes > _LEAST_CORRELATION * np.maximum(norms, 1e-300)).all():
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


# [count] Equal values at the extreme, in a row, that mean clipping: a cell's noise repeats no value
# that often
_PLATEAU = 5
# [share of the range] A plateau within this distance of the extreme counts: less than any noise
_EXTREME = 1e-6
# [share of the largest force] Mean at rest that means that the cell was not zeroed: that of a force
# that a user would see in every result
_OFFSET = 0.1
# [share of the largest feature] A frame is at rest if the mean of its features is below it: noise
# is below it, and a contact of a tenth of the force above
_STILL = 0.05
_FEWEST = 3  # [count] Fewest frames at rest from which an offset is known
# [share of the largest force] A press begins above the one and ends below the other: so far apart
# that noise ends no press
_PRESSED = 0.3
_RELEASED = 0.05


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
        at_extreme = side >= side.max() - _EXTREME * span
        if _longest_run(at_extreme) >= _PLATEAU:
            return True
    return False


def at_rest(features: Float64) -> Bool:
    """(N,) True for the frames whose (N, K) features are small on average."""
    sizes = np.abs(features)
    largest = sizes.max(0)
    shares = sizes[:, largest > 0] / largest[largest > 0]
    if not shares.shape[1]:
        return np.ones(len(features), np.bool_)
    return np.asarray(shares.mean(1) <= _STILL)


def rest_offset(force: Float64, at_rest: Bool) -> float:
    """Return the mean force at rest if it is too large for a cell that was zeroed, else 0."""
    known = at_rest & np.isfinite(force)
    if known.sum() < _FEWEST:
        return 0.0
    offset = float(np.median(force[known]))
    largest = float(np.nanmax(np.abs(force - offset)))
    return offset if 0 < _OFFSET * largest < abs(offset) else 0.0


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
        if pressed and here <= _RELEASED:
            number, pressed = number + 1, False
        pressed |= bool(here > _PRESSED)
        runs[index] = number
    if number and not pressed:
        runs[runs == number] = number - 1  # the rest after the last press
    return runs


def _longest_run(found: Bool) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], found, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


# [share] Share of the errors that are smaller than one standard deviation: definition: of normal
# errors, 68.27 %
_WITHIN = 0.6827
_ROUNDS = 4  # [count] Rounds of reweighting: the third changes nothing
# [share of the largest error] Least standard deviation: a perfect fit has no standard deviation of
# zero, which nothing could be compared with
_LEAST = 1e-3


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
    floor = (_LEAST * float(np.sqrt(squares.max()))) ** 2
    if floor == 0:
        return ForceError(0.0, 0.0)
    columns = np.stack([np.ones_like(load), load**2], 1)
    found = np.array([squares.mean(), 0.0])
    for _ in range(_ROUNDS):
        weights = 1 / np.maximum(columns @ found, floor)
        found, _ = nnls(columns * weights[:, None], squares * weights)
    found[0] = max(found[0], floor)
    ratios = np.abs(errors) / np.sqrt(columns @ found)
    rest, share = np.sqrt(found) * np.quantile(ratios, _WITHIN)
    return ForceError(float(rest), float(share))
