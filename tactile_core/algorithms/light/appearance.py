"""Whether an image shows the gel of a reference, and if not, what was done to it.

All comparisons are between logarithms of intensities in coarse cells. Where nothing touches the
gel, frame and reference differ by one gain per channel. A contact changes the rest, but only in the
ways in which a tilt of the surface can, which are two of the K dimensions of a change of colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import permutations, product
from typing import Literal, NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import shorths
from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.light.drift import LEVELS

ROWS, COLUMNS = 20, 26  # Cells of the grid, count; each is the mean of 2 × 2 samples


# Logarithms of intensity at which a robust fit ignores cells, one after another.
SCALES = 0.4, 0.2, 0.1, 0.06, 0.04

FEWEST_CELLS = 60  # Cells that a comparison needs, count


# Shares of the view that a cropped image may show.
ZOOMS = 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95


Mistake = Literal["channels_swapped", "turned", "mirrored", "cropped", "grey", "another_unit"]


class Alternative(NamedTuple):
    """The reference as it would look after a mistake.

    Attributes
    ----------
    cause : Mistake
    log : (K, N) float32
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
        (K, N) float32, (N,) bool
        """
        if pixels.flags.c_contiguous:
            samples = self._samples(pixels).astype(np.float32)
        else:
            planes = [self._samples(plane) for plane in pixels.transpose(2, 0, 1)]
            samples = np.stack(planes, axis=-1).astype(np.float32)
        shown: Array | np.float32 = np.float32(1)
        if hidden is not None:
            shows = np.float32(1) - self._samples(hidden.view(np.uint8))
            samples *= shows[..., None]
            shown = self._means(shows).ravel()
        means = np.ascontiguousarray(self._means(samples).reshape(-1, samples.shape[2]).T)
        means /= np.maximum(shown, 0.25) * np.float32(full_scale)
        means += shown == 0  # a cell that markers hide is not readable, but it is not black
        # [share of the full scale] brighter cells say nothing
        readable = (means.min(axis=0) > LEVELS.dark_share) & (means.max(axis=0) < 0.98)
        return np.log(np.maximum(means, LEVELS.dark_share)), readable

    @staticmethod
    def black(log: Array) -> Bool:
        """Return which cells (N,) are dark in every channel, as no contact makes them."""
        return np.asarray(log.max(axis=0) <= np.log(np.float32(LEVELS.dark_share)) + 1e-6)

    def _samples(self, image: Array) -> Array:
        """Return every n-th pixel, (2 R, 2 C) or (2 R, 2 C, K), alike from both ends."""
        size = 2 * self.shape[1], 2 * self.shape[0]
        return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_NEAREST_EXACT)).reshape(
            *size[::-1], *image.shape[2:]
        )

    def _means(self, samples: Array) -> Array:
        """Average (2 R, 2 C, …) samples over the four of each cell."""
        return np.asarray(cv2.resize(samples, self.shape[::-1], interpolation=cv2.INTER_AREA))


def _sums(samples: Array) -> Array:
    """Sum (K, 2 R, 2 C) cells over each four."""
    across = samples[..., 0::2] + samples[..., 1::2]
    return np.asarray(across[:, 0::2] + across[:, 1::2])


def fit_smooth_field(change: Array, basis: Array, scales: tuple[float, ...]) -> Array:
    """Fit a smooth field to the cells that agree with it; a contact is ignored.

    Iteratively reweighted least squares with Tukey's biweight, whose scale shrinks [1]_, from the
    densest half of each channel.

    Parameters
    ----------
    change : (K, N)
    basis : (M, N)
        Row 0 is 1.
    scales : sequence of float
        Decreasing.

    Returns
    -------
    (K, M)

    References
    ----------
    .. [1] A. Blake and A. Zisserman, "Visual Reconstruction", MIT Press, 1987 (graduated
       non-convexity).
    """
    coefficients = np.zeros((len(change), len(basis)), np.float32)
    coefficients[:, 0] = shorths(change)
    ridge = 1e-4 * np.eye(len(basis), dtype=np.float32)
    for scale in scales:
        square = np.square(change - coefficients @ basis).mean(axis=0)
        weight = np.maximum(1 - square / (4 * scale * scale), 0) ** 2 + 1e-4
        weighted = basis * weight
        coefficients = np.linalg.solve(weighted @ basis.T + ridge, weighted @ change.T).T
    return coefficients


def agreement(residual: Array, tolerance: float) -> float:
    """Return the share of cells that agree, 0 to 1, from (K, N) residuals."""
    largest = np.abs(residual).max(axis=0) / tolerance
    return float((np.maximum(1 - largest * largest, 0) ** 2).mean())


def polynomial(shape: tuple[int, int], order: int) -> Array:
    """Return all products of powers of x and y up to an order, (M, N) float32; both in −1…1."""
    y, x = np.meshgrid(*(np.linspace(-1, 1, n, dtype=np.float32) for n in shape), indexing="ij")
    powers = [(i, j) for i in range(order + 1) for j in range(order + 1 - i)]
    return np.stack([(x**i * y**j).ravel() for i, j in sorted(powers, key=sum)])


class Appearance:
    """The reference in coarse cells, and as it would look after each kind of mistake.

    Parameters
    ----------
    reference : (H, W, K)
        Image of the undeformed gel.
    full_scale : float
    hidden : (H, W) bool, optional
        Its markers.
    view : (3, 3) float, optional
        Homography from this image to the camera's, in which mistakes are made; the edges of both
        are at −1 and 1. Default: they are the same image.
    """

    def __init__(
        self,
        reference: Array,
        full_scale: float,
        hidden: Bool | None = None,
        view: Array | None = None,
    ) -> None:
        self.cells = Cells(reference.shape[:2])
        self.log, self.seen = self.cells.log(reference, full_scale, hidden)
        self.plane = polynomial(self.cells.shape, 1)
        self._view = np.eye(3) if view is None else view

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Every mistake that has a look of its own."""
        found = [*self._move_camera(), *self._recolour_image()]
        # one that looks like the reference itself would be found in every frame
        return tuple(one for one in found if self._predict_change(one).any())

    def change(self, log: Array, readable: Bool) -> tuple[Array, Bool]:
        """Return the change of the logarithm against the reference, less each channel's gain.

        Returns
        -------
        (K, N), (N,) bool
            The change, 0 where a cell is not readable in both; and where it is.
        """
        both = readable & self.seen
        change = log - self.log
        if np.count_nonzero(both) >= FEWEST_CELLS:
            seen = change.compress(both, axis=1)[:, ::2]
            middle = seen.shape[1] // 2
            change -= np.partition(seen, middle, axis=1)[:, middle, None]
        return change * both, both

    def cause(self, log: Array, readable: Bool, change: Array, margin: float) -> Mistake | None:
        """Return the mistake that explains a frame better than none does.

        Parameters
        ----------
        log, readable
            The frame's; see :meth:`Cells.log`.
        change : (K, N)
            See :meth:`change`.
        margin : float
            Share of the cells by which it must explain more.
        """
        if not self.alternatives:  # an even reference looks alike whatever was done to it
            return None
        responses = self._filters @ self._blur_change(change)
        best: float = margin
        why: Mistake | None = None
        # [of a matched filter] From here on an alternative is examined; 1 if it is true
        for index in np.flatnonzero(responses > 0.5):
            one = self.alternatives[index]
            both = readable & self.seen & one.seen
            if np.count_nonzero(both) < FEWEST_CELLS:
                continue
            base = self._explained_share(log - self.log, both)
            more = self._explained_share(log - one.log, both) - base
            name = one.cause
            if name == "cropped":
                # another light can look a little like a zoom, which then explains little of it
                # [share of what differs] explained by a zoom
                little = more < 0.25 * (1 - base) or responses[index] > 1.5
                name, more = ("another_unit", more - 0.03) if little else (name, more + 0.035)
            if more > best:
                best, why = more, name
        return why

    def _explained_share(self, change: Array, both: Bool) -> float:
        plane, change = self.plane[:, both], change[:, both]
        # [log of intensity] about 6 %
        return agreement(change - fit_smooth_field(change, plane, SCALES) @ plane, 0.06)

    @cached_property
    def _filters(self) -> Array:
        """(alternatives, K N / 4): filters that respond with 1 to a frame that shows one."""
        filters = np.stack([self._predict_change(one) for one in self.alternatives])
        return np.asarray(filters / np.square(filters).sum(axis=1, keepdims=True))

    def _blur_change(self, change: Array) -> Array:
        """Return the clipped sums over four cells, (K N / 4): a filter needs no more."""
        # [log of intensity] of four cells, each counts at most a tenth
        return np.clip(_sums(self._image(change)).ravel(), -0.4, 0.4)

    def _predict_change(self, one: Alternative) -> Array:
        both = self.seen & one.seen
        if not both.any():
            return np.zeros(self.log.size // 4, np.float32)
        change = one.log - self.log
        change = change - np.median(change[:, both], axis=1, keepdims=True)
        return self._blur_change(change * both)

    def _image(self, values: Array) -> Array:
        return values.reshape(-1, *self.cells.shape)

    def _recolour_image(self) -> Iterator[Alternative]:
        channels = len(self.log)
        if channels != 3:
            return
        for order in [*permutations(range(channels))][1:]:
            yield Alternative("channels_swapped", self.log[list(order)], self.seen)
        grey = np.log(np.exp(self.log).mean(axis=0, keepdims=True))
        yield Alternative("grey", np.repeat(grey, channels, axis=0), self.seen)

    def _move_camera(self) -> Iterator[Alternative]:
        """Yield what a camera that shows the gel elsewhere would show."""
        rows, columns = self.cells.shape
        edges = np.array(
            [[2 / columns, 0, 1 / columns - 1], [0, 2 / rows, 1 / rows - 1], [0, 0, 1]]
        )
        to_camera = self._view @ edges
        seen = self._image(self.seen.astype(np.float32))[0]
        planes = [_fill_unseen(plane, seen) for plane in self._image(self.log)]
        for cause, motion in _motions():
            matrix = np.linalg.solve(to_camera, motion @ to_camera)

            def shown(plane: Array, matrix: Array = matrix) -> Array:
                flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
                return np.asarray(cv2.warpPerspective(plane, matrix, (columns, rows), flags=flags))

            log = np.stack([shown(plane) for plane in planes]).reshape(self.log.shape)
            yield Alternative(cause, log, shown(seen).ravel() > 0.99)


def _motions() -> Iterator[tuple[Mistake, Array]]:
    """Yield where in the right image a point of the wrong one is, as homographies."""
    yield "turned", np.diag([-1.0, -1, 1])
    yield "turned", np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    yield "turned", np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    yield "mirrored", np.diag([-1.0, 1, 1])
    yield "mirrored", np.diag([1.0, -1, 1])
    for zoom, x, y in product(ZOOMS, (-1, 0, 1), (-1, 0, 1)):
        yield "cropped", np.array([[zoom, 0, (1 - zoom) * x], [0, zoom, (1 - zoom) * y], [0, 0, 1]])


def _fill_unseen(plane: Array, seen: Array) -> Array:
    """Return a plane (R, C) whose unseen cells have the mean of their seen neighbours."""
    around = cv2.blur(plane * seen, (5, 5)) / np.maximum(cv2.blur(seen, (5, 5)), 1e-3)
    return np.where(seen > 0, plane, around)
