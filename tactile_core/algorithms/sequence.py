"""Which lamp shines in which exposure, told from the broad pattern that each one leaves.

The skin is brighter near the lamp. Where it rests, an exposure divided by the untouched image of
the *same* lamp is one constant, whatever the lamp's drift or the exposure time; divided by that of
*another* lamp it changes across the image. So the width of the narrowest half of the logarithms of
that quotient tells whether an exposure shows a lamp, as long as some of the skin rests: contacts
fall into the other half. Where a contact leaves no skin at rest nothing can be told, and nothing
is refused.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.half_sample import narrowest
from tactile_core.algorithms.arrays.types import Array

_ROWS, _COLUMNS = 16, 20
_BLOCK = 3

_FITS_BETTER = 0.65
"""A right exposure of a ball grid fits its own lamp 1.9 times better than any other."""

_SAME, _SAME_UNSEEN = 0.3, 0.1
"""Two lamps' exposures differ about as much as their references do, and, where these are unknown,
never ten times less than lamps usually do."""

_DARK_AMONG, _DARK_ALONE = 0.5, 0.3
_FLOOR = 0.004


class Pattern(NamedTuple):
    """What is kept of an observation of K exposures.

    Attributes
    ----------
    logs : (K, N) float32
        Logarithm of the brightness, as a fraction of full scale, on a coarse grid.
    brightness : (K,) float32
        Mean intensity as a fraction of full scale.
    """

    logs: Array
    brightness: Array


class SequenceFault(NamedTuple):
    """What is wrong with an exposure.

    Attributes
    ----------
    exposure : int
        The light whose exposure it is.
    shows : int or None
        The light that it shows instead; None where it is dark.
    certain : bool
        False where it is only known that the exposures of these two lights show the same one.
    """

    exposure: int
    shows: int | None
    certain: bool = True


def pattern(pixels: Array, full_scale: float) -> Pattern:
    """Shrink one observation to what tells its lamps apart.

    Parameters
    ----------
    pixels : (H, W, K)
        One exposure per channel.
    full_scale : float
        The intensity at which a channel saturates.
    """
    at = []
    for size, cells in zip(pixels.shape[:2], (_ROWS, _COLUMNS), strict=True):
        samples = cells * _BLOCK if size >= cells * _BLOCK else min(size, cells)
        at.append(np.linspace(0, size - 1, samples).astype(np.intp))
    few = pixels[np.ix_(*at)]
    grid = min(_COLUMNS, few.shape[1]), min(_ROWS, few.shape[0])
    # means of neighbouring samples, so that the grain of the coating averages out
    means = cv2.resize(few.astype(np.float32), grid, interpolation=cv2.INTER_AREA)
    means = means.reshape(-1, pixels.shape[2]).T * np.float32(1 / full_scale)
    return Pattern(np.log(means + np.float32(_FLOOR)), means.mean(axis=1))


def faults(seen: Pattern, reference: Pattern | None = None) -> tuple[SequenceFault, ...]:
    """Find the exposures that do not show their own light.

    Parameters
    ----------
    seen : Pattern
        Of the observation.
    reference : Pattern, optional
        Of the untouched sensor under the same lights in the right order. Without one, only a dark
        exposure among bright ones and two exposures of one light are found.

    Returns
    -------
    tuple of Fault
        Empty for a good observation.
    """
    expected = np.ones_like(seen.brightness) if reference is None else reference.brightness
    level = seen.brightness / np.maximum(expected, _FLOOR)
    dark = (level < _DARK_AMONG * np.median(level)) | (seen.brightness < _FLOOR)
    if reference is not None:
        dark |= level < _DARK_ALONE
    found = [SequenceFault(int(k), None) for k in np.flatnonzero(dark)]
    bright = np.flatnonzero(~dark)
    if reference is not None:
        width = _widths(seen.logs, reference.logs)
        for k in bright:
            best = int(np.argmin(width[k]))
            if width[k, best] < _FITS_BETTER * width[k, k]:
                found.append(SequenceFault(int(k), best))
    if found:
        return tuple(sorted(found, key=lambda fault: fault.exposure))
    return _repeated(seen.logs, bright, reference)


def _repeated(logs: Array, bright: Array, reference: Pattern | None) -> tuple[SequenceFault, ...]:
    first, second = np.triu_indices(len(bright), 1)
    first, second = bright[first], bright[second]
    if not len(first):
        return ()
    width = _half_width(logs[second] - logs[first])
    if reference is None:
        same = width < _SAME_UNSEEN * np.median(width)
    else:
        same = width < _SAME * _half_width(reference.logs[second] - reference.logs[first])
    return tuple(
        SequenceFault(int(j), int(i), certain=False)
        for i, j, is_same in zip(first, second, same, strict=True)
        if is_same
    )


def _widths(logs: Array, reference: Array) -> Array:
    """(K, K): how much the quotient of each exposure and each reference varies."""
    return _half_width(logs[:, None] - reference[None])


def _half_width(values: Array) -> Array:
    """Length of the shortest interval that holds half of the values, along the last axis."""
    _, length = narrowest(np.sort(values, axis=-1), values.shape[-1] // 2 + 1)
    return length
