"""Strain of the gel surface from the regularity of its printed markers, without a reference.

Markers are printed on a square lattice. The view of the camera distorts it smoothly, so a
polynomial in row and column predicts every marker of the undeformed surface. A contact displaces
markers from the polynomial.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float64, Intp, pitch
from tactile_core.algorithms.markers.neighbourhood import nearest


class MARKER_LATTICE:
    """Parameters of the strain of a marker lattice."""

    # [pitches] Largest distance of a marker from the place that its neighbour predicts. Source:
    # less than half a pitch, where the nearest marker becomes ambiguous.
    reach = 0.35
    # [pitches] Largest median distance of a marker from where its neighbours place it. A contact
    # displaces neighbours alike; markers that were printed less regularly hide its strain.
    # Source: geometric mean of the limits of two recorded sensors: 0.006 to 0.02 where the
    # markers form a lattice and 0.035 to 0.06 where they were placed one by one.
    irregularity = 0.027
    # [share of the variance] A larger irregularity in the first frame is strain if it is at most
    # this share of the deviation from the polynomial, because a contact displaces neighbours
    # alike. Of markers that were placed one by one it is 1.25: the variance of the difference of
    # a marker and the mean of four others. In later frames a growing contact would hide them.
    # Source: half, so that neighbours explain most of the deviation.
    independent_share = 0.5
    spare_markers = 5  # [count] Markers that are needed beyond the number of polynomial terms
    # [s] An undetected marker keeps its last strain for this time; strongly sheared markers are
    # the first to be lost, so leaving them out at once would look like a release. Source:
    # duration over which a contact settles, ``CONTACT_LOSS.settle_s``.
    hold_s = 0.5


class MarkerLattice:
    """Strain of a lattice of markers over time.

    Parameters
    ----------
    px : (N, 2)
        Positions of the markers in any frame, x and y; a contact in it does no harm as long as
        neighbours remain neighbours.

    Attributes
    ----------
    regular : bool
        Whether the markers form a square lattice with enough markers to measure strain.
    """

    def __init__(self, px: Array) -> None:
        self._pitch_px = pitch(px)
        self._chosen, nodes = lattice_nodes(px)
        terms = _polynomial(nodes)
        self._terms = terms
        least = terms.shape[1] + MARKER_LATTICE.spare_markers
        share = len(nodes) / max(len(px), 1)
        # [share of the markers] With fewer on the lattice there is none
        found = len(nodes) >= least and share >= 0.6
        # [frames] A strong contact in the first displaces the markers; this is about a second
        self._undecided = 25 if found else 0
        self.regular = found and (self._is_regular(px) or self._is_strained(px))
        self._fit: _Fit | None = None
        self._apart: Float64 | None = None
        self._apart_s = 0.0
        self._square = np.zeros(len(nodes))
        self._seen_s = np.full(len(nodes), -np.inf)

    def strain(self, px: Array, seen: Bool, time_s: float) -> float | None:
        """Return the strain of the next frame.

        Parameters
        ----------
        px : (N, 2)
            Positions of the same markers.
        seen : (N,) bool
            False for markers whose position is not measured.
        time_s : float
            Time of the frame, not before that of the previous one.

        Returns
        -------
        float or None
            Root mean square distance of the markers from the polynomial, relative to the pitch. It
            is noise without contact. None if the markers form no lattice, or too few are seen.
        """
        if self._undecided and not self.regular:
            self._undecided -= 1
            self.regular = self._is_regular(px)
        if not self.regular:
            return None
        count, key = self._terms.shape[1], np.asarray(seen, np.bool_).tobytes()
        if self._fit is None or key != self._fit.seen:
            detected = np.asarray(seen, np.bool_)[self._chosen]
            self._fit = _Fit.from_markers(key, detected, self._chosen, self._terms)
        fit = self._fit
        if len(fit.markers) < count + MARKER_LATTICE.spare_markers:
            return None
        places = np.asarray(px, np.float64).take(fit.markers, axis=0)
        apart = places - fit.terms @ (fit.inverse @ places)
        if fit.detected is None:
            # the squares are needed only once a marker is not detected
            self._apart, self._apart_s = apart, time_s
            total, held = float(np.vdot(apart, apart)), len(apart) - count
        else:
            square = self._squares()
            square[fit.detected] = (apart * apart) @ _ONES
            self._seen_s[fit.detected] = time_s
            recent = self._seen_s >= time_s - MARKER_LATTICE.hold_s
            total, held = float(square @ recent), int(np.count_nonzero(recent)) - count
        return math.sqrt(total / held) / self._pitch_px

    def _squares(self) -> Float64:
        """Squared distance of each marker (M,) from the polynomial when it was last detected."""
        if self._apart is not None:
            self._square, self._apart = (self._apart * self._apart) @ _ONES, None
            self._seen_s[:] = self._apart_s
        return self._square

    def _is_regular(self, px: Array) -> bool:
        """Whether neighbours place the median marker where it is."""
        return self._irregularity(px)[0] <= MARKER_LATTICE.irregularity

    def _is_strained(self, px: Array) -> bool:
        """Whether neighbours explain most of the deviation of the median marker."""
        irregularity, deviation = self._irregularity(px)
        return irregularity**2 <= MARKER_LATTICE.independent_share * deviation**2

    def _irregularity(self, px: Array) -> tuple[float, float]:
        """Median distances from where the neighbours place a marker, and the polynomial does."""
        places = np.asarray(px, np.float64)[self._chosen]
        found = np.linalg.lstsq(self._terms, places, rcond=None)[0]
        apart = (places - self._terms @ found) / self._pitch_px
        _, near = nearest(places, places, _SQUARE_NEIGHBOURS + 1)
        alone = apart - apart[near[:, 1:]].mean(axis=1)
        irregularity, deviation = (np.median(np.linalg.norm(d, axis=1)) for d in (alone, apart))
        return float(irregularity), float(deviation)


class _Fit(NamedTuple):
    """The polynomial fit to the detected markers; most often they are those of the last frame.

    Attributes
    ----------
    seen : bytes
        Which of all markers are seen.
    detected : (M,) bool or None
        Which of those on the lattice are; None if all of them.
    markers : (N,) intp
        Numbers of these.
    terms : (N, terms)
        Of the detected markers.
    inverse : (terms, N)
        Coefficients for places of 1.
    """

    seen: bytes
    detected: Bool | None
    markers: Intp
    terms: Float64
    inverse: Float64

    @classmethod
    def from_markers(cls, seen: bytes, detected: Bool, chosen: Intp, terms: Float64) -> _Fit:
        terms = terms[detected]
        markers, some = chosen[detected], None if detected.all() else detected
        if len(terms) < terms.shape[1] + MARKER_LATTICE.spare_markers:
            return cls(seen, some, markers, terms, terms.T)
        # normal equations: the terms are of order 1, and much faster than a decomposition
        inverse = np.linalg.solve(terms.T @ terms, terms.T)
        return cls(seen, some, markers, terms, np.asarray(inverse, np.float64))


_ONES = np.ones(2)  # Sums x and y

_SQUARE_NEIGHBOURS = 4  # Nearest neighbours of a marker on a square lattice


def lattice_nodes(px: Array) -> tuple[Intp, Intp]:
    """Number markers by column and row of a square lattice, growing from the centre.

    Parameters
    ----------
    px : (N, 2)
        Positions, x and y.

    Returns
    -------
    chosen : (M,) intp
        Index of each marker on the lattice; empty if the markers form no square lattice.
    nodes : (M, 2) intp
        Its column and row, in the directions of the lattice.
    """
    none = np.zeros(0, np.intp), np.zeros((0, 2), np.intp)
    if len(px) <= MARKER_LATTICE.spare_markers:
        return none
    places = np.asarray(px, np.float64).view(np.complex128)[:, 0].copy()
    size = pitch(px)
    along = _direction(places, px, size)
    if along is None:
        return none
    start = int(np.abs(places - places.mean()).argmin())
    found: dict[int, tuple[int, int]] = {start: (0, 0)}
    waiting = deque([(start, along * size, 1j * along * size)])
    while waiting:
        number, across, down = waiting.popleft()
        column, row = found[number]
        for right, below in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            predicted = places[number] + right * across + below * down
            far = np.abs(places - predicted)
            near = int(far.argmin())
            if far[near] > MARKER_LATTICE.reach * size or near in found:
                continue
            # [weight] The lattice vector follows perspective and distortion, and averages over
            # noise
            step, follow = places[near] - places[number], 0.3
            found[near] = column + right, row + below
            if right:
                waiting.append((near, across + follow * (right * step - across), down))
            else:
                waiting.append((near, across, down + follow * (below * step - down)))
    return np.fromiter(found, np.intp), np.array(list(found.values()), np.intp)


def _direction(places: Array, px: Array, size: float) -> complex | None:
    """Unit vector along the lattice, or None if it is not square."""
    _, near = nearest(px, px, min(_SQUARE_NEIGHBOURS + 1, len(px)))
    steps = (places[near[:, 1:]] - places[:, np.newaxis]).ravel()
    steps = steps[np.abs(np.abs(steps) / size - 1) < MARKER_LATTICE.reach]
    fourfold = complex(np.mean((steps / np.abs(steps)) ** 4)) if len(steps) else 0j
    # [resultant length] half-way between random or hexagonal, 0, and square, 1
    if abs(fourfold) < 0.5:
        return None
    return complex(np.exp(0.25j * np.angle(fourfold)))


def _polynomial(nodes: Intp) -> Float64:
    """(M, terms) powers of column and row, scaled to −1 to 1."""
    order = 3  # a lens's radial distortion is cubic in its first term (Brown 1971)
    if not len(nodes):
        return np.zeros((0, (order + 1) * (order + 2) // 2))
    middle = (nodes.max(axis=0) + nodes.min(axis=0)) / 2
    x, y = ((nodes - middle) / max(float(np.abs(nodes - middle).max()), 1.0)).T
    return np.stack([x**i * y**j for i in range(order + 1) for j in range(order + 1 - i)], axis=1)
