"""Faults of a load cell that its own readings show: clipped, not zeroed, constant."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float64, Intp


class LABEL_FAULTS:
    """Limits of a healthy load cell. Nothing sets them from outside."""

    # [count] Equal values at the extreme, in a row, that mean clipping. Source: by hand, : a
    # cell's noise repeats no value that often.
    plateau = 5
    # [share of the range] A plateau within this distance of the extreme counts. Source: by hand,
    # : less than any noise.
    extreme = 1e-6
    # [share of the largest force] Mean at rest that means that the cell was not zeroed. Source:
    # by hand, : that of a force that a user would see in every result.
    offset = 0.1
    # [share of the largest feature] A frame is at rest if the mean of its features is below it.
    # Source: by hand, : noise is below it, and a contact of a tenth of the force above.
    still = 0.05
    fewest = 3  # [count] Fewest frames at rest from which an offset is known
    # [share of the largest force] A press begins above the one and ends below the other. Source:
    # by hand, : so far apart that noise ends no press.
    pressed = 0.3
    released = 0.05


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
        at_extreme = side >= side.max() - LABEL_FAULTS.extreme * span
        if _longest_run(at_extreme) >= LABEL_FAULTS.plateau:
            return True
    return False


def at_rest(features: Float64) -> Bool:
    """(N,) True for the frames whose (N, K) features are small on average."""
    sizes = np.abs(features)
    largest = sizes.max(0)
    shares = sizes[:, largest > 0] / largest[largest > 0]
    if not shares.shape[1]:
        return np.ones(len(features), np.bool_)
    return np.asarray(shares.mean(1) <= LABEL_FAULTS.still)


def rest_offset(force: Float64, at_rest: Bool) -> float:
    """Return the mean force at rest if it is too large for a cell that was zeroed, else 0."""
    known = at_rest & np.isfinite(force)
    if known.sum() < LABEL_FAULTS.fewest:
        return 0.0
    offset = float(np.median(force[known]))
    largest = float(np.nanmax(np.abs(force - offset)))
    return offset if 0 < LABEL_FAULTS.offset * largest < abs(offset) else 0.0


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
        if pressed and here <= LABEL_FAULTS.released:
            number, pressed = number + 1, False
        pressed |= bool(here > LABEL_FAULTS.pressed)
        runs[index] = number
    if number and not pressed:
        runs[runs == number] = number - 1  # the rest after the last press
    return runs


def _longest_run(found: Bool) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], found, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))
