"""A contact that is wider than the view: its border, where slip begins, is not visible.

Under such an object the whole view moves alike, so lags of a few percent decide. There is no rim
across which a field is blurred, and the surface bends slowly: a polynomial of low order describes
the field and averages the noise of all markers.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Complex64, Intp


class WIDE_CONTACT:
    """Parameters of contacts wider than the view."""

    # [share of the view's border] A contact that covers more of the border is wider than the
    # view. Source: half, as for the contact area (ADR 31).
    border_share = 0.5
    # [exponent] Order of the polynomial. Source: virtual plates in shear: 2 and 3 warn alike, and
    # a slip zone along one side needs 3 (ADR 51).
    order = 3
    # [ratio] The squared share of rotation above which a motion is not smoothed: the swirl around
    # a stick region is not a polynomial of this order. Source: half, where rotation outweighs
    # translation.
    turned_share = 0.5
    # [share of the motion] Lag of a point that sticks. There is no blurred border, which needs
    # the larger tolerance of other contacts. Source: 95 % of the points of a virtual plate that
    # sticks lag by less (ADR 51).
    tolerance = 0.02
    # [share of the largest lag] Minimum tolerance of the lag: a polynomial rings where the
    # surface lags abruptly. Source: chosen on virtual plates that slip quasi-statically (ADR 51).
    ringing = 0.1
    # [ratio] Noise of one marker relative to the standard deviation that its field reports, which
    # also covers what lies between the markers. Source: 0.44 and 0.41 for virtual markers 1.1 and
    # 2.2 mm apart (ADR 51).
    noise_share = 0.43
    # [count] Markers of a field whose number is not known. Source: a view of 18 mm × 13 mm with
    # markers 1.1 mm apart.
    markers = 192
    # [standard deviations] Minimum tolerance of the lag. Source: 95 % quantile of a Rayleigh
    # distribution.
    sigmas = 2.45


def fills_view(mask: Bool) -> bool:
    """Return whether a contact (h, w) covers most of the border of the view."""
    return rim_share(mask) >= WIDE_CONTACT.border_share


def rim_share(mask: Bool) -> float:
    """Return the share of the border of the view that a mask (h, w) covers; corners count twice."""
    rim = _rim(mask.shape)
    return np.count_nonzero(mask.take(rim)) / len(rim)


@lru_cache(maxsize=4)
def _rim(shape: tuple[int, ...]) -> Intp:
    """Flat indices of the points at the border of the view; corners twice."""
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    return np.concatenate([index[0], index[-1], index[:, 0], index[:, -1]])


def smoothed_std_mm(std_mm: float, markers: int | None) -> float:
    """Return the standard deviation of a smoothed motion between two frames.

    Parameters
    ----------
    std_mm : float
        Reported standard deviation of the field.
    markers : int or None
        Number of markers that are seen; None if it is not known.
    """
    order = WIDE_CONTACT.order
    terms = (order + 1) * (order + 2) / 2
    count = max(WIDE_CONTACT.markers if markers is None else markers, terms)
    return WIDE_CONTACT.noise_share * std_mm * float(np.sqrt(2 * terms / count))


def smooth_displacement(displacement: Complex64, position: Complex64) -> Complex64:
    """Return displacements (n,) as a polynomial of the positions (n,), both x + iy in mm."""
    scale = max(float(np.abs(position).max()), 1e-9)
    x, y = position.real / scale, position.imag / scale
    order = WIDE_CONTACT.order
    terms: NDArray[Any] = np.stack(
        [x**i * y**j for i in range(order + 1) for j in range(order + 1 - i)], axis=1
    ).astype(np.float64)
    parts = np.stack([displacement.real, displacement.imag], axis=1).astype(np.float64)
    fitted = terms @ np.linalg.lstsq(terms, parts, rcond=None)[0]
    return np.asarray(fitted[:, 0] + 1j * fitted[:, 1], np.complex64)
