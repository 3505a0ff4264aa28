"""What the decoder's tables leave: their noise, and slopes that depend on the position.

The tables follow any response of the camera, but are noisy; a polynomial of the normalised colour
is smooth, but stiff. Their errors differ, so that the mean is better than either. The matrices that
normalise the illumination map colours to an average colour, not slopes to true slopes, so that a
part of the slope that is linear in the colour remains at each position. A frame full
of contacts changes the light between them, which looks like a tilt; the reference has none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import comb
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_baxter_fingertip.hue_decoder import HueDecoder, normalise_colours
from tactile_baxter_fingertip.tables import ENTRIES, Float32
from tactile_core.algorithms.arrays import regression
from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial


class CORRECTION:
    """Parameters of the correction. Nothing sets them: colours are normalised."""

    # [order] Order of the polynomial of the colour. Source: as good as 5 on held-out balls of the
    # same frame.
    colour_order = 4
    # [weight per sample] Penalty of the curvature of that polynomial. Source: that of
    # ``core.polynomial``.
    curvature_ridge = 0.01
    # [order] Order of the polynomials of the position. Source: that of the decoder's
    # normalisation.
    place_order = 2
    # [weight per sample] Ridge penalty of the part that depends on the position, with the colour
    # in its standard deviations. Source: by hand, keeps the equations regular.
    ridge = 1e-3
    # [sine of the slope angle] Steeper pixels count as sloped, in the share that a press has of
    # the image. Source: by hand, above the noise and the apparent tilt of level gel.
    steep_sine = 0.1


@dataclass(frozen=True, eq=False)
class HueCorrection:
    """A polynomial of the colour and slopes by position, which correct a decoder.

    Attributes
    ----------
    polynomial : PolynomialFit
        Normalised colour to normal_xy.
    by_place : (6, 4, 2) float32
        For each monomial of the position, the components x and y of an apparent tilt under a press,
        and their change with the three components of the normalised colour.
    steep_share : float
        Mean share of sloped pixels in the calibration frames; 0 if it is not known.
    """

    polynomial: PolynomialFit
    by_place: Float32
    steep_share: float = 0.0

    def strength(self, steep_share: float) -> np.float32:
        """Return the share of the tilt, 0 to 1, in a frame with this share of sloped pixels."""
        return np.float32(min(1.0, steep_share / self.steep_share) if self.steep_share else 0.0)

    def correction_at(self, position: Float32) -> Float32:
        """Return tilt and change with the colour (N, 4, 2) at (N, 2) positions."""
        terms = regression.terms(position, CORRECTION.place_order)
        return np.asarray(np.tensordot(terms, self.by_place, 1), np.float32)

    def by_chroma(self, decoder: HueDecoder) -> NDArray[np.complex64]:
        """Return the polynomial as (5, 256, 256) complex64 tables by both chroma axes.

        They are its coefficients of the powers 0 to 4 of the intensity, which is −1 for the first
        entry and 1 for the last. The real part is the component along x, the imaginary along y.
        """
        chroma = np.indices((ENTRIES, ENTRIES)).reshape(2, -1).T
        levels = np.linspace(0, ENTRIES - 1, CORRECTION.colour_order + 1).round()
        values = []
        for level in levels:
            entries = np.column_stack([chroma, np.full(len(chroma), level)])
            both = self.polynomial(colour_of(decoder, entries))
            values.append(both[:, 0] + 1j * both[:, 1])
        powers = np.vander(to_signed(levels), increasing=True)
        tables = np.linalg.solve(powers, np.array(values))
        return np.asarray(tables.reshape(-1, ENTRIES, ENTRIES), np.complex64)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays for :meth:`from_arrays`, by name."""
        place = {"by_place": self.by_place, "steep_share": np.array(self.steep_share)}
        return {**self.polynomial.arrays(), **place}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild a correction.

        Raises
        ------
        LookupError, ValueError
            An array is missing, misshapen or not finite.
        """
        by_place = arrays["by_place"]
        if by_place.shape != (6, 4, 2) or not np.isfinite(by_place).all():
            raise ValueError("by_place does not fit a correction")
        return cls(PolynomialFit.from_arrays(arrays), by_place, float(arrays["steep_share"]))


def correct_normals(
    decoder: HueDecoder, correction: HueCorrection, features: Float32, strength: float = 1.0
) -> Float32:
    """Return normal_xy (N, 2) of (N, 5) relative changes and positions.

    ``strength`` is the share of the tilt by a press.
    """
    colour = normalise_colours(features, decoder.evening)
    mean = (decoder(features) + _smooth(decoder, correction.polynomial, colour)) / 2
    tilt_first = np.column_stack([np.full(len(colour), strength, np.float32), colour])
    by_place = np.einsum("nk,nkj->nj", tilt_first, correction.correction_at(features[:, 3:]))
    return np.asarray(mean + by_place, np.float32)


def fit_correction(
    decoder: HueDecoder, features: Float32, normal_xy: Float32, *, by_place: bool
) -> HueCorrection:
    """Fit to the pixels of the decoder; the share of sloped pixels remains open.

    Samples without a slope are not under a press.

    Parameters
    ----------
    decoder : HueDecoder
    features : (N, 5) float32
        Relative change of the three channels, and position.
    normal_xy : (N, 2) float32
        Components of the normal along x and y, uphill.
    by_place : bool
        Whether to fit the part that depends on the position. It needs presses all over the view;
        from a dozen single ones it would be extrapolated, and tilt the level gel around them.
    """
    colour = normalise_colours(features, decoder.evening)
    polynomial = fit_polynomial(
        colour,
        normal_xy,
        order=CORRECTION.colour_order,
        ridge=CORRECTION.curvature_ridge,
        curvature_only=True,
    )
    if not by_place:
        count = comb(2 + CORRECTION.place_order, 2)
        return HueCorrection(polynomial, np.zeros((count, 4, 2), np.float32))
    missing = normal_xy - (decoder(features) + _smooth(decoder, polynomial, colour)) / 2
    pressed = normal_xy.any(axis=1)
    scale = np.array([1, *np.maximum(colour.std(axis=0), 1e-6)])
    columns = np.column_stack([pressed, colour]) / scale
    terms = regression.terms(features[:, 3:].astype(np.float64), CORRECTION.place_order)
    products = (terms[:, :, None] * columns[:, None, :]).reshape(len(terms), -1)
    normal = products.T @ products + CORRECTION.ridge * len(terms) * np.eye(products.shape[1])
    found = np.linalg.solve(normal, products.T @ missing).reshape(terms.shape[1], 4, 2)
    return HueCorrection(polynomial, np.asarray(found / scale[:, None], np.float32))


def colour_of(decoder: HueDecoder, entries: NDArray[Any]) -> Float32:
    """Return the (N, 3) normalised colours of (N, 3) entries of chroma and intensity."""
    factors, offsets = decoder.to_entries
    return np.asarray((entries - offsets) / factors, np.float32)


def _smooth(decoder: HueDecoder, polynomial: PolynomialFit, colour: Float32) -> Float32:
    """Evaluate the polynomial at the entries of (N, 3) colours, within their range."""
    chroma, intensity = decoder.entries(colour)
    return polynomial(colour_of(decoder, np.column_stack([chroma, intensity])))


def to_signed(entries: NDArray[Any]) -> NDArray[Any]:
    """Map entries 0 to 255 to −1 to 1."""
    return entries / ((ENTRIES - 1) / 2) - 1
