"""The order of images, and whether two show one scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import narrowest, vertex
from tactile_core.algorithms.arrays.types import Array


class SEQUENCE:
    """Parameters of the verification of exposures.

    Nothing sets them from outside: they are ratios, the same for every rig with sequential lights.
    """

    # [count] Cells of the grid on which exposures are compared.
    rows = 16
    columns = 20
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
        # [count] Samples along each side of a cell, averaged to reduce the noise of the coating.
        wanted = cells * 3
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
    dark = level < 0.5 * np.median(level)  # [ratio] among the others
    dark |= seen.brightness < SEQUENCE.dark_share
    if reference is not None:
        dark |= level < 0.3  # [ratio] to the reference
    found = [SequenceFault(int(k), None) for k in np.flatnonzero(dark)]
    bright = np.flatnonzero(~dark)
    if reference is not None:
        width = _widths(seen.logs, reference.logs)
        for k in bright:
            best = int(np.argmin(width[k]))
            # [ratio] An exposure shows another light if its quotient with that reference is
            # narrower by this. Source: chosen on the six-LED ball grids, where a correct exposure
            # is narrower with its own reference by a factor of at least 1.9 (ADR 9).
            if width[k, best] < 0.65 * width[k, k]:
                found.append(SequenceFault(int(k), best))
    if found:
        return tuple(sorted(found, key=lambda fault: fault.exposure))
    return _find_repeated(seen.logs, bright, reference)


def _find_repeated(
    logs: Array, bright: Array, reference: Pattern | None
) -> tuple[SequenceFault, ...]:
    first, second = np.triu_indices(len(bright), 1)
    first, second = bright[first], bright[second]
    if not len(first):
        return ()
    width = _half_width(logs[second] - logs[first])
    if reference is None:
        # [ratio] Two exposures show one light if they differ by less than this share of the median
        # difference between two.
        same = width < 0.1 * np.median(width)
    else:
        apart = _half_width(reference.logs[second] - reference.logs[first])
        # [ratio] Two exposures show one light if they differ by less than this share of the
        # difference between their references.
        same = width < 0.3 * apart
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


# Width and height at which images are compared: an imprint still fills some pixels.
_SIZE_PX = 32, 24


_LEAST_CHANGE = 0.006  # Of full scale. Noise and the light change by less, and are unrelated, too.


def are_unrelated(pairs: Sequence[tuple[NDArray[Any], NDArray[Any]]]) -> bool:
    """Whether neighbouring images differ as much as any two of them.

    The squared difference of neighbours over twice the variance of all, the ratio of von Neumann
    [1]_, is about 1 for images in any order and small for those of a motion. Its lower quartile
    decides, because much may change at once where an object slips, but not all the time. One image
    alone shows no motion either; of two nobody can know; and images that hardly differ are those
    of a gel at rest.

    Parameters
    ----------
    pairs : sequence of two (H, W) or (H, W, 3) uint8 or uint16
        Each an image and the one after it.

    References
    ----------
    .. [1] J. von Neumann, "Distribution of the ratio of the mean square successive difference to
       the variance", Annals of Mathematical Statistics 12(4), 1941.
    """
    if len(pairs) < 2:
        return not pairs
    small = np.array([[_small(image) for image in pair] for pair in pairs])
    variance = small.reshape(-1, small[0, 0].size).var(axis=0, ddof=1).mean()
    successive = np.square(small[:, 1] - small[:, 0]).reshape(len(small), -1).mean(axis=1)
    ratio = np.quantile(successive, 0.25) / (2 * variance) if variance > _LEAST_CHANGE**2 else 0.0
    return bool(ratio > 0.4)  # [ratio] recorded presses have 0.49 or more, grasps 0.25 or less


def _small(image: NDArray[Any]) -> NDArray[np.float32]:
    """Reduce an image to shares of full scale, without its mean light."""
    small = cv2.resize(image, _SIZE_PX, interpolation=cv2.INTER_AREA)
    small = small.astype(np.float32) / np.float32(np.iinfo(image.dtype).max)
    return np.asarray(small - np.median(small, axis=(0, 1)), np.float32)


def imprint_distance(pixels: Array, reference: Array) -> tuple[float, float] | None:
    """Measure the vector from one imprint to the other by the autocorrelation of the change.

    Parameters
    ----------
    pixels, reference : (H, W) or (H, W, K)
        The gel with both imprints, and undeformed.

    Returns
    -------
    (dx, dy) in px, dx not negative, or None
        None without two imprints of the same shape.
    """
    # [share of the brightest] the logarithm of darker pixels is noise
    least = 0.02 * max(float(np.max(reference)), 1e-9)
    pressed, rest = (
        np.log(np.maximum(np.asarray(image, np.float32), least)) for image in (pixels, reference)
    )
    # [px] Noise would sharpen the central peak
    change = np.atleast_3d(cv2.GaussianBlur(pressed - rest, (0, 0), 1.0))
    change = change - np.median(change, axis=(0, 1))
    height, width = change.shape[:2]
    size = (2 * height, 2 * width)
    spectrum = np.fft.rfft2(change, s=size, axes=(0, 1))
    alike = np.fft.fftshift(np.fft.irfft2((np.abs(spectrum) ** 2).sum(axis=2), s=size))
    alike /= max(float(alike[height, width]), 1e-9)
    y, x = np.mgrid[-height:height, -width:width]
    distance = np.hypot(x, y)
    ring = distance.astype(int).ravel()
    profile = np.bincount(ring, alike.ravel()) / np.bincount(ring)
    # [radii of the central peak] Closer imprints share their slopes
    far = (distance > 1.5 * int(np.argmax(profile < 0))) & (x >= 0)
    row, column = np.unravel_index(int(np.where(far, alike, -1).argmax()), alike.shape)
    inside = 0 < row < 2 * height - 1 and 0 < column < 2 * width - 1
    # [correlation] two equal imprints have 0.5, single balls less than this
    if not inside or alike[row, column] < 0.25:
        return None
    across, down = alike[row, column - 1 : column + 2], alike[row - 1 : row + 2, column]
    return float(x[row, column] + vertex(across)), float(y[row, column] + vertex(down))
