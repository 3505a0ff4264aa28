"""Markers printed on the skin: where they are, and how they darken it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Float32, Float64
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.gel import Markers
from tactile_core.sim.optics.faults import Faults

SHAPES = ("round", "square", "triangle")
"""What markers look like; compiled loops know them by their places here."""

_FURTHEST_SIZES = 0.75
"""No corner of any shape is further from its middle."""

_JITTER_PITCHES = 0.22
_AUTO_PITCH_WIDTHS = 1 / 14
_AUTO_DIAMETER_PITCHES = 0.36
_BEYOND_PITCHES = 2
_BRIDGED_PITCHES = 1.2


@dataclass(frozen=True, eq=False)
class MarkerPrint:
    """The print of one gel.

    Attributes
    ----------
    rest_px : (N, 2) float64
        Centres on the resting skin, x and y; some lie beyond the image, and shear may bring them
        into it.
    angles : (N,) float64
        By how much each is turned, rad from x towards y.
    size_px : float
        Diameter of a round marker, side of a square or a triangle.
    shape : {"round", "square", "triangle"}
    worn : (N,) bool
        Markers that are missing.
    joined : (M, 2) int
        Pairs of markers whose ink has run together.
    """

    rest_px: Float64
    angles: Float64
    size_px: float
    shape: str
    worn: NDArray[np.bool_]
    joined: NDArray[np.int_]

    @classmethod
    def of(cls, profile: SensorBuild, faults: Faults, seed: int) -> MarkerPrint | None:
        """Return the print that the profile's gel carries; None for a bare one."""
        told = profile.gel.markers
        if told is None:
            return None
        image, look = profile.image, profile.optics.markers
        if isinstance(told, Markers):
            pitch, size = told.pitch_mm / image.mm_per_px, told.diameter_mm / image.mm_per_px
        else:
            pitch = _AUTO_PITCH_WIDTHS * image.width_px
            size = _AUTO_DIAMETER_PITCHES * pitch
        x, y = (_places(n, pitch) for n in (image.width_px, image.height_px))
        centres = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
        angles = np.zeros(len(centres))
        if look.layout == "quasi_random":
            rng = np.random.default_rng([seed, 11])
            reach = min(_JITTER_PITCHES * pitch, max(0.0, (pitch - size) / 2.2))
            centres = centres + rng.uniform(-reach, reach, centres.shape)
            angles = rng.uniform(0, 2 * np.pi, len(centres))
        worn = faults.worn(len(centres), seed)
        joined = faults.joined(centres, seed)
        return cls(centres, angles, size, look.shape, worn, joined)

    @property
    def margin_px(self) -> int:
        """How far around the image there are markers."""
        lowest = self.rest_px.min()
        return max(0, int(np.floor(-lowest - self.size_px)))

    def cover(self, shape: tuple[int, int], centres_px: Float64) -> Float32:
        """Draw the markers where they are now.

        Parameters
        ----------
        shape : (height, width) in px
        centres_px : (N, 2) float
            x and y. Markers whose place is not finite or lies outside are left out.

        Returns
        -------
        (H, W) float32
            Share of each pixel that is printed.
        """
        centres, turned = self.blots(centres_px, shape)
        half = int(np.ceil(_FURTHEST_SIZES * self.size_px)) + 1
        corner = np.rint(centres).astype(int) - half
        window = np.arange(2 * half + 1)
        x = corner[:, 0, None, None] + window - centres[:, 0, None, None]
        y = corner[:, 1, None, None] + window[:, None] - centres[:, 1, None, None]
        cos, sin = np.cos(turned)[:, None, None], np.sin(turned)[:, None, None]
        distance = self._outside(x * cos + y * sin, y * cos - x * sin)
        shares = np.clip(0.5 - distance, 0, 1).astype(np.float32)
        beyond = 2 * half + 1
        cover = np.zeros((shape[0] + 2 * beyond, shape[1] + 2 * beyond), np.float32)
        for share, (left, top) in zip(shares, corner + beyond, strict=True):
            here = cover[top : top + beyond, left : left + beyond]
            np.maximum(here, share, out=here)
        return np.ascontiguousarray(cover[beyond:-beyond, beyond:-beyond])

    def blots(self, centres_px: Float64, shape: tuple[int, int]) -> tuple[Float64, Float64]:
        """Places and turns of all ink within reach of an image: markers, and bridges between some.

        Parameters
        ----------
        centres_px : (N, 2) float
            Where the markers are now.
        shape : (height, width) in px

        Returns
        -------
        centres : (M, 2) float64
        turned : (M,) float64
        """
        centres, turned = self._all_blots(np.asarray(centres_px, np.float64))
        reach = _FURTHEST_SIZES * self.size_px
        near = ((centres > -reach) & (centres < np.array(shape[::-1]) - 1 + reach)).all(1)
        return centres[near], turned[near]

    def _all_blots(self, centres_px: Float64) -> tuple[Float64, Float64]:
        """Places and turns of all ink: markers that have not worn off, and bridges between some."""
        first, second = centres_px[self.joined[:, 0]], centres_px[self.joined[:, 1]]
        count = int(np.ceil(_BRIDGED_PITCHES * self._pitch_px / self.size_px))
        bridges = [first + (second - first) * k / (count + 1) for k in range(1, count + 1)]
        kept = ~self.worn
        centres = np.concatenate([centres_px[kept], *bridges])
        turned = np.concatenate([self.angles[kept], np.zeros(count * len(first))])
        return centres, turned

    @property
    def _pitch_px(self) -> float:
        pairs = self.rest_px[self.joined]
        return float(np.linalg.norm(pairs[:, 0] - pairs[:, 1], axis=1).max(initial=0.0))

    def _outside(self, x: Float64, y: Float64) -> Float64:
        """Distance from the outline, px; negative inside."""
        if self.shape == "round":
            return np.asarray(np.hypot(x, y) - self.size_px / 2)
        if self.shape == "square":
            return np.asarray(np.maximum(abs(x), abs(y)) - self.size_px / 2)
        sides = np.radians([90.0, 210.0, 330.0])
        reach = np.max([x * np.cos(a) + y * np.sin(a) for a in sides], axis=0)
        return np.asarray(reach - self.size_px / (2 * np.sqrt(3)))


def _places(length_px: int, pitch_px: float) -> Float64:
    """Centres along one side, symmetric about the middle, and some beyond the image."""
    count = int(length_px / pitch_px) + 2 * _BEYOND_PITCHES
    return np.asarray((length_px - 1) / 2 + from_middle(count) * pitch_px)
