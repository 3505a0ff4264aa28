"""Whether an image shows the gel of a reference, and if not, what was done to it.

All comparisons are between logarithms of intensities in coarse cells. Where nothing touches the
gel, frame and reference differ by one gain per channel. A contact changes the rest, but only in the
ways in which a tilt of the surface can, which are two of the K dimensions of a change of colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import permutations
from typing import Literal, NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.half_sample import shorths
from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.drift import DRIFT

ROWS, COLUMNS = 20, 26
"""Cells of the grid, count; each is the mean of 2 × 2 samples."""

TOLERANCE = 0.06
"""Logarithm of intensity by which a cell may differ and still agree: about 6 %."""

SCALES = 0.4, 0.2, 0.1, 0.06, 0.04
"""Logarithms of intensity at which a robust fit ignores cells, one after another."""

FEWEST_CELLS = 60
"""Cells that a comparison needs, count."""

BRIGHTEST = 0.98
"""Share of the full scale from which on a cell is too bright to compare."""

ZOOMS = 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95
"""Shares of the view that a cropped image may show."""

RESPONSE = 0.5
"""Response of a matched filter from which on an alternative is examined; 1 if it is true."""

CLIP = 0.1
"""Largest logarithm of intensity of one cell that counts in a matched filter."""


Mistake = Literal["channels_swapped", "turned", "mirrored", "cropped", "grey"]


class Alternative(NamedTuple):
    """The reference as it would look after a mistake.

    Attributes
    ----------
    cause : Mistake
    log : (N, K) float32
        Logarithm of intensity.
    seen : (N,) bool
        Cells that show the gel.
    """

    cause: Mistake
    log: Array
    seen: Bool


class Cells:
    """Means of an image's intensities on a coarse grid, without hidden pixels.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns of the image.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        rows, columns = (max(2, size // 4 * 2) for size in shape)
        self.shape = min(ROWS, rows), min(COLUMNS, columns)
        down, across = (
            np.linspace(0, size - 1, 2 * cells).astype(np.intp)
            for size, cells in zip(shape, self.shape, strict=True)
        )
        self._places = (down[:, None] * shape[1] + across).ravel()

    def log(self, pixels: Array, full_scale: float, hidden: Bool | None) -> tuple[Array, Bool]:
        """Return the logarithm of each cell's mean, and which cells are readable.

        Parameters
        ----------
        pixels : (H, W, K)
        full_scale : float
        hidden : (H, W) bool or None
            Pixels that do not show the gel surface, such as markers.

        Returns
        -------
        (N, K) float32, (N,) bool
        """
        rows, columns = self.shape
        if pixels.flags.c_contiguous:
            samples = pixels.reshape(-1, pixels.shape[2]).take(self._places, axis=0).T
        else:
            planes = pixels.transpose(2, 0, 1)
            samples = np.stack([plane.ravel().take(self._places) for plane in planes])
        samples = samples.astype(np.float32, order="C").reshape(-1, 2 * rows, 2 * columns)
        shown: Array | np.float32 = np.float32(4)
        if hidden is not None:
            shows = ~hidden.take(self._places).reshape(2 * rows, 2 * columns)
            samples *= shows
            shown = _sums(shows.astype(np.float32)[None]).ravel()
        means = _sums(samples).reshape(len(samples), -1)
        means /= np.maximum(shown, 1) * np.float32(full_scale)
        readable = (means.min(axis=0) > DRIFT.dark_share) & (means.max(axis=0) < BRIGHTEST)
        readable &= shown > 0
        return np.log(np.maximum(means, DRIFT.dark_share)).T, readable


def _sums(samples: Array) -> Array:
    """Sum (K, 2 R, 2 C) samples over the four of each cell."""
    across = samples[..., 0::2] + samples[..., 1::2]
    return np.asarray(across[:, 0::2] + across[:, 1::2])


def fitted(change: Array, basis: Array, scales: tuple[float, ...]) -> Array:
    """Fit a smooth field to the cells that agree with it; a contact is ignored.

    Iteratively reweighted least squares with Tukey's biweight, whose scale shrinks [1]_, from the
    densest half of each channel.

    Parameters
    ----------
    change : (N, K)
    basis : (N, M)
        Column 0 is 1.
    scales : sequence of float
        Decreasing.

    Returns
    -------
    (M, K)

    References
    ----------
    .. [1] A. Blake and A. Zisserman, "Visual Reconstruction", MIT Press, 1987 (graduated
       non-convexity).
    """
    coefficients = np.zeros((basis.shape[1], change.shape[1]), np.float32)
    coefficients[0] = shorths(change.T)
    ridge = 1e-4 * np.eye(basis.shape[1], dtype=np.float32)
    for scale in scales:
        square = np.square(change - basis @ coefficients).mean(axis=1)
        weight = np.maximum(1 - square / (4 * scale * scale), 0) ** 2 + 1e-4
        weighted = (basis * weight[:, None]).T
        coefficients = np.linalg.solve(weighted @ basis + ridge, weighted @ change)
    return coefficients


def agreement(residual: Array, tolerance: float) -> float:
    """Return the share of cells that agree, 0 to 1, from (N, K) residuals."""
    largest = np.abs(residual).max(axis=1) / tolerance
    return float((np.maximum(1 - largest * largest, 0) ** 2).mean())


def polynomial(shape: tuple[int, int], order: int) -> Array:
    """Return all products of powers of x and y up to an order, (N, M) float32; both in −1…1."""
    y, x = np.meshgrid(*(np.linspace(-1, 1, n, dtype=np.float32) for n in shape), indexing="ij")
    powers = [(i, j) for i in range(order + 1) for j in range(order + 1 - i)]
    return np.stack([x**i * y**j for i, j in sorted(powers, key=sum)], axis=-1).reshape(y.size, -1)


class Appearance:
    """The reference in coarse cells, and as it would look after each kind of mistake.

    Parameters
    ----------
    reference : (H, W, K)
        Image of the undeformed gel.
    full_scale : float
    hidden : (H, W) bool, optional
        Its markers.
    """

    def __init__(self, reference: Array, full_scale: float, hidden: Bool | None = None) -> None:
        self.cells = Cells(reference.shape[:2])
        self.log, self.seen = self.cells.log(reference, full_scale, hidden)
        self.plane = polynomial(self.cells.shape, 1)

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Every mistake that has a look of its own."""
        found = [*self._turned(), *self._recoloured(), *self._cropped()]
        # one that looks like the reference itself would be found in every frame
        return tuple(
            one for one in found if self._blurred(self._expected(one, one.log - self.log)).any()
        )

    def change(self, log: Array, readable: Bool) -> tuple[Array, Bool]:
        """Return the change of the logarithm against the reference, less each channel's gain.

        Returns
        -------
        (N, K), (N,) bool
            The change, 0 where a cell is not readable in both; and where it is.
        """
        both = readable & self.seen
        change = log - self.log
        if np.count_nonzero(both) >= FEWEST_CELLS:
            seen = change[both]
            change -= np.partition(seen, len(seen) // 2, axis=0)[len(seen) // 2]
        return np.where(both[:, None], change, np.float32(0)), both

    def cause(self, log: Array, readable: Bool, change: Array, margin: float) -> Mistake | None:
        """Return the mistake that explains a frame better than none does.

        Parameters
        ----------
        log, readable
            The frame's; see :meth:`Cells.log`.
        change : (N, K)
            See :meth:`change`.
        margin : float
            Share of the cells by which it must explain more.
        """
        if not self.alternatives:  # an even reference looks alike whatever was done to it
            return None
        responses = self._filters @ self._blurred(np.clip(change, -CLIP, CLIP))
        best: float = margin
        why: Mistake | None = None
        for index in np.flatnonzero(responses > RESPONSE):
            one = self.alternatives[index]
            both = readable & self.seen & one.seen
            if np.count_nonzero(both) < FEWEST_CELLS:
                continue
            base = self._explained(log - self.log, both)
            more = self._explained(log - one.log, both) - base
            if one.cause == "cropped":
                # a change of the light can look like a small zoom, but never explains most of it
                more = more - 0.03 if more < 0.25 * (1 - base) else more + 0.035
            if more > best:
                best, why = more, one.cause
        return why

    def _explained(self, change: Array, both: Bool) -> float:
        plane, change = self.plane[both], change[both]
        return agreement(change - plane @ fitted(change, plane, SCALES), TOLERANCE)

    @cached_property
    def _filters(self) -> Array:
        """(alternatives, N K / 4): filters that respond with 1 to a frame that shows one."""
        expected = [self._expected(one, one.log - self.log) for one in self.alternatives]
        filters = np.stack([self._blurred(one) for one in expected])
        return np.asarray(filters / np.square(filters).sum(axis=1, keepdims=True))

    def _blurred(self, change: Array) -> Array:
        """Return the sums over four cells, (N K / 4): a filter needs no more."""
        return _sums(change.T.reshape(-1, *self.cells.shape)).ravel()

    def _expected(self, one: Alternative, change: Array) -> Array:
        both = self.seen & one.seen
        if not both.any():
            return np.zeros_like(change)
        change = change - np.median(change[both], axis=0)
        return np.where(both[:, None], np.clip(change, -CLIP, CLIP), np.float32(0))

    def _image(self, values: Array) -> Array:
        return values.reshape(*self.cells.shape, -1)

    def _turned(self) -> Iterator[Alternative]:
        log, seen = self._image(self.log), self._image(self.seen)[..., 0]

        def flipped(cause: Mistake, *axes: int) -> Alternative:
            shown = np.flip(log, axes).reshape(self.log.shape)
            return Alternative(cause, shown, np.flip(seen, axes).ravel())

        yield flipped("turned", 0, 1)
        yield flipped("mirrored", 1)
        yield flipped("mirrored", 0)

    def _recoloured(self) -> Iterator[Alternative]:
        channels = self.log.shape[1]
        if channels != 3:
            return
        for order in [*permutations(range(channels))][1:]:
            yield Alternative("channels_swapped", self.log[:, order], self.seen)
        grey = np.log(np.exp(self.log).mean(axis=1, keepdims=True))
        yield Alternative("grey", np.repeat(grey, channels, axis=1), self.seen)

    def _cropped(self) -> Iterator[Alternative]:
        rows, columns = self.cells.shape
        filled = _filled(self._image(self.log), self._image(self.seen)[..., 0])
        seen = np.ones(self.seen.shape, np.bool_)
        for zoom in ZOOMS:
            for down in (0.0, 0.5, 1.0):
                for across in (0.0, 0.5, 1.0):
                    shift = (1 - zoom) * np.array([(columns - 1) * across, (rows - 1) * down])
                    matrix = np.array([[zoom, 0, shift[0]], [0, zoom, shift[1]]], np.float32)
                    shown = np.dstack(
                        [
                            cv2.warpAffine(
                                np.ascontiguousarray(filled[..., k]),
                                matrix,
                                (columns, rows),
                                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                                borderMode=cv2.BORDER_REPLICATE,
                            )
                            for k in range(filled.shape[2])
                        ]
                    )
                    yield Alternative("cropped", shown.reshape(self.log.shape), seen)


def _filled(image: Array, seen: Bool) -> Array:
    """Return an image (R, C, K) whose unseen cells have the mean of their seen neighbours."""
    if seen.all():
        return image
    weight = cv2.blur(seen.astype(np.float32), (5, 5))
    around = cv2.blur(np.where(seen[..., None], image, np.float32(0)), (5, 5))
    around = around.reshape(image.shape) / np.maximum(weight, 1e-3)[..., None]
    return np.where(seen[..., None], image, around)
