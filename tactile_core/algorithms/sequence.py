"""Verification of sequential exposures: which light each exposure shows.

The gel surface is brighter near the light. Where the surface is undeformed, an exposure divided by
the reference of the *same* light is constant, whatever the drift or the exposure time. Divided by
the reference of *another* light it varies across the image. So the width of the narrowest half of
the logarithms of this quotient identifies the light; contacts fall into the other half. Where a
contact leaves no undeformed surface, the exposure cannot be identified, and no fault is reported.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.half_sample import narrowest
from tactile_core.algorithms.arrays.types import Array


class SEQUENCE:
    """Parameters of the verification of exposures.

    Nothing sets them from outside: they are ratios, the same for every rig with sequential lights.
    """

    # [count] Cells of the grid on which exposures are compared.
    rows = 16
    columns = 20
    # [count] Samples along each side of a cell, averaged to reduce the noise of the coating.
    samples_across_cell = 3
    # [ratio] An exposure shows another light if its quotient with that reference is narrower by
    # this. Source: chosen on the six-LED ball grids, where a correct exposure is narrower with
    # its own reference by a factor of at least 1.9 (ADR 9).
    better_ratio = 0.65
    # [ratio] Two exposures show one light if they differ by less than this share of the
    # difference between their references.
    same_ratio = 0.3
    # [ratio] The same as a share of the median difference between two exposures.
    same_ratio_without_reference = 0.1
    # [ratio] An exposure is dark if its brightness relative to the reference is below
    # ``dark_among`` times the median of all exposures, or below ``dark_alone``.
    dark_among = 0.5
    dark_alone = 0.3
    # [share of the full scale] Mean intensity below which an exposure is dark, and offset of the
    # logarithm. Source: one grey level of 8 bits, about 1 / 255.
    dark_share = 0.004


class Pattern(NamedTuple):
    """Broad brightness pattern of an observation of K exposures.

    Attributes
    ----------
    logs : (K, N) float32
        Logarithm of the brightness, as a share of the full scale, on a coarse grid.
    brightness : (K,) float32
        Mean intensity as a share of the full scale.
    """

    logs: Array
    brightness: Array


class SequenceFault(NamedTuple):
    """A fault of one exposure.

    Attributes
    ----------
    exposure : int
        Index of the exposure, which is the index of the light that it should show.
    shows : int or None
        Index of the light that it shows instead; None where it is dark.
    certain : bool
        False where the two exposures show the same light, but it is unknown which of the two.
    """

    exposure: int
    shows: int | None
    certain: bool = True


def pattern(pixels: Array, full_scale: float) -> Pattern:
    """Reduce one observation to the broad patterns that distinguish its lights.

    Parameters
    ----------
    pixels : (H, W, K)
        One exposure per channel.
    full_scale : float
        The intensity at which a channel saturates.
    """
    at = []
    for size, cells in zip(pixels.shape[:2], (SEQUENCE.rows, SEQUENCE.columns), strict=True):
        wanted = cells * SEQUENCE.samples_across_cell
        samples = wanted if size >= wanted else min(size, cells)
        at.append(np.linspace(0, size - 1, samples).astype(np.intp))
    sampled = pixels[np.ix_(*at)]
    grid = min(SEQUENCE.columns, sampled.shape[1]), min(SEQUENCE.rows, sampled.shape[0])
    # means of neighbouring samples average out the noise of the coating
    means = cv2.resize(sampled.astype(np.float32), grid, interpolation=cv2.INTER_AREA)
    means = means.reshape(-1, pixels.shape[2]).T * np.float32(1 / full_scale)
    return Pattern(np.log(means + np.float32(SEQUENCE.dark_share)), means.mean(axis=1))


def faults(seen: Pattern, reference: Pattern | None = None) -> tuple[SequenceFault, ...]:
    """Find the exposures that do not show their own light.

    Parameters
    ----------
    seen : Pattern
        Pattern of the observation.
    reference : Pattern, optional
        Pattern of the undeformed sensor under the same lights in the correct order. Without it,
        only a dark exposure among bright ones and two exposures of one light are found.

    Returns
    -------
    tuple of SequenceFault
        In the order of the exposures; empty for a good observation.
    """
    expected = np.ones_like(seen.brightness) if reference is None else reference.brightness
    level = seen.brightness / np.maximum(expected, SEQUENCE.dark_share)
    dark = level < SEQUENCE.dark_among * np.median(level)
    dark |= seen.brightness < SEQUENCE.dark_share
    if reference is not None:
        dark |= level < SEQUENCE.dark_alone
    found = [SequenceFault(int(k), None) for k in np.flatnonzero(dark)]
    bright = np.flatnonzero(~dark)
    if reference is not None:
        width = _widths(seen.logs, reference.logs)
        for k in bright:
            best = int(np.argmin(width[k]))
            if width[k, best] < SEQUENCE.better_ratio * width[k, k]:
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
        same = width < SEQUENCE.same_ratio_without_reference * np.median(width)
    else:
        apart = _half_width(reference.logs[second] - reference.logs[first])
        same = width < SEQUENCE.same_ratio * apart
    return tuple(
        SequenceFault(int(j), int(i), certain=False)
        for i, j, is_same in zip(first, second, same, strict=True)
        if is_same
    )


def _widths(logs: Array, reference: Array) -> Array:
    """Spread of the quotient of each exposure and each reference, (K, K)."""
    return _half_width(logs[:, None] - reference[None])


def _half_width(values: Array) -> Array:
    """Length of the shortest interval that holds half of the values, along the last axis."""
    _, length = narrowest(np.sort(values, axis=-1), values.shape[-1] // 2 + 1)
    return length
