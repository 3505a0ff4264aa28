"""Printed markers: their layout, and the shading that they cause."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32, Float64, from_middle
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.gel import Markers
from tactile_sim.optics.faults import Faults

# [marker diameters] Upper bound on the distance of a marker's corners from its centre: geometry:
# 1/√2 for a square, 1/√3 for a triangle
_CORNER_SIZES = 0.75
# [count] Markers across the image width if the profile's markers are ``auto``
_AUTO_COLUMNS: float = 14
# [relative to the bare surface] Reflectance of black ink, and of white ink on a grey coating
_INK = {"dark": 0.06, "bright": 2.0}


@dataclass(frozen=True, eq=False)
class MarkerPrint:
    """Printed markers of one gel.

    Attributes
    ----------
    rest_px : (N, 2) float64
        Centres on the undeformed surface, x and y. Some are outside the image; shear may move
        them into it.
    angles : (N,) float64
        Rotation of each marker, rad, positive from x towards y.
    size_px : float
        Diameter of a round marker, side of a square or a triangle.
    shape : {"round", "square", "triangle"}
    ink : float
        Reflectance relative to the bare surface.
    worn : (N,) bool
        Missing markers.
    joined : (M, 2) int
        Pairs of merged markers.
    """

    rest_px: Float64
    angles: Float64
    size_px: float
    shape: str
    ink: float
    worn: NDArray[np.bool_]
    joined: NDArray[np.int_]

    @classmethod
    def from_profile(cls, profile: SensorBuild, faults: Faults, seed: int) -> MarkerPrint | None:
        """Return the markers of the profile's gel; None without markers."""
        markers = profile.gel.markers
        if markers is None:
            return None
        image, look = profile.image, profile.optics.markers
        if isinstance(markers, Markers):
            pitch, size = markers.pitch_mm / image.mm_per_px, markers.diameter_mm / image.mm_per_px
        else:
            pitch = 1 / _AUTO_COLUMNS * image.width_px
            # [pitches] If the profile's markers are ``auto``: near the 0.40 mm per 1.2 mm of [1]_
            size = 0.36 * pitch
        x, y = (_positions(n, pitch) for n in (image.width_px, image.height_px))
        centres = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
        angles = np.full(len(centres), np.radians(look.angle_deg))
        if look.layout == "quasi_random":
            rng = np.random.default_rng([seed, 11])
            # [ratio] Two markers that approach each other share the gap; a tenth more keeps them
            # apart
            clear = max(0.0, (pitch - size) / 2.2)
            # [pitches] Largest offset of a quasi-random marker along x and y
            reach = min(0.22 * pitch, clear)
            centres = centres + rng.uniform(-reach, reach, centres.shape)
            angles = rng.uniform(0, 2 * np.pi, len(centres))
        if look.jitter_mm:
            rng = np.random.default_rng([seed, 12])
            centres = centres + rng.normal(0, look.jitter_mm / image.mm_per_px, centres.shape)
        centres = _mount_print(centres, profile)
        worn = faults.draw_worn(len(centres), seed)
        joined = faults.draw_joined(centres, seed)
        return cls(centres, angles, size, look.shape, reflectance_of_ink(profile), worn, joined)

    def reflectance(self, shape: tuple[int, int], centres_px: Float64) -> Float32:
        """Draw the markers at their current positions.

        Parameters
        ----------
        shape : (height, width) in px
        centres_px : (N, 2) float
            x and y. Markers that are outside the image or not finite are skipped.

        Returns
        -------
        (H, W) float32
            1 on the bare surface.
        """
        centres, angles = self._blots(centres_px, shape)
        half = int(np.ceil(self._reach(self.angles) * self.size_px)) + 1
        corner = np.rint(centres).astype(int) - half
        window = np.arange(2 * half + 1)
        x, y = (
            (first[:, None] + window - middle[:, None]).astype(np.float32)
            for first, middle in zip(corner.T, centres.T, strict=True)
        )
        shares = 0.5 - self._outside(x[:, None], y[..., None], angles.astype(np.float32))
        np.clip(shares, 0, 1, out=shares)
        # a border for windows that are partly outside; the farthest centre is that of a blot
        beyond = int(np.ceil(_CORNER_SIZES * self.size_px)) + half + 1
        covered = np.zeros((shape[0] + 2 * beyond, shape[1] + 2 * beyond), np.float32)
        flat, width = covered.reshape(-1), covered.shape[1]
        first = (corner[:, 1] + beyond) * width + corner[:, 0] + beyond
        places = first[:, None, None] + (window[:, None] * width + window)
        flat[places] = shares
        # where markers overlap, the larger share remains
        while (lost := flat[places] < shares).any():
            flat[places[lost]] = shares[lost]
        return 1 + np.float32(self.ink - 1) * covered[beyond:-beyond, beyond:-beyond]

    def _blots(self, centres_px: Float64, shape: tuple[int, int]) -> tuple[Float64, Float64]:
        """Positions and rotations of all ink visible in an image.

        Ink is either a marker that is not worn off, or part of the bridge between two merged
        markers.

        Parameters
        ----------
        centres_px : (N, 2) float
            Current positions of the markers.
        shape : (height, width) in px

        Returns
        -------
        centres : (M, 2) float64
        angles : (M,) float64
        """
        centres_px = np.asarray(centres_px, np.float64)
        first, second = centres_px[self.joined[:, 0]], centres_px[self.joined[:, 1]]
        # [ratio] Density of the ink between two merged markers
        count = int(np.ceil(1.2 * self._pitch_px / self.size_px))
        bridges = [first + (second - first) * k / (count + 1) for k in range(1, count + 1)]
        kept = ~self.worn
        centres = np.concatenate([centres_px[kept], *bridges])
        angles = np.concatenate([self.angles[kept], np.zeros(count * len(first))])
        reach = _CORNER_SIZES * self.size_px
        near = ((centres > -reach) & (centres < np.array(shape[::-1]) - 1 + reach)).all(1)
        return centres[near], angles[near]

    def _reach(self, angles: Float64) -> float:
        """Largest distance of a marker's ink from its centre along x or y, in sizes."""
        if self.shape == "round":
            return 0.5
        if self.shape == "square":
            return float(0.5 * (abs(np.cos(angles)) + abs(np.sin(angles))).max(initial=1.0))
        return _CORNER_SIZES

    @cached_property
    def _pitch_px(self) -> float:
        pairs = self.rest_px[self.joined]
        return float(np.linalg.norm(pairs[:, 0] - pairs[:, 1], axis=1).max(initial=0.0))

    def _outside(self, x: Float32, y: Float32, angles: Float32) -> Float32:
        """Distance from the outlines of N markers, px; negative inside.

        Parameters
        ----------
        x : (N, 1, w) float32
            Position relative to the centre, px.
        y : (N, w, 1) float32
        angles : (N,) float32
        """
        half = np.float32(self.size_px / 2)
        if self.shape == "round":
            return np.asarray(np.sqrt(x * x + y * y) - half)
        if angles.any():
            cos, sin = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
            x, y = x * cos + y * sin, y * cos - x * sin
        if self.shape == "square":
            return np.asarray(np.maximum(abs(x), abs(y)) - half)
        sides = np.radians(np.array([90, 210, 330], np.float32))
        reach = np.max([x * np.cos(a) + y * np.sin(a) for a in sides], axis=0)
        return np.asarray(reach - np.float32(self.size_px / (2 * np.sqrt(3))))


def reflectance_of_ink(profile: SensorBuild) -> float:
    """Return the reflectance of a profile's markers relative to the bare surface."""
    markers, ink = profile.gel.markers, profile.optics.coat.ink
    if ink is not None:
        return ink
    return _INK[markers.tone if isinstance(markers, Markers) else "dark"]


def _mount_print(centres_px: Float64, profile: SensorBuild) -> Float64:
    """Rotate the print about the image centre, and shift it."""
    image, look = profile.image, profile.optics.markers
    middle = (np.array([image.width_px, image.height_px]) - 1) / 2
    cos, sin = np.cos(np.radians(look.angle_deg)), np.sin(np.radians(look.angle_deg))
    turned = (centres_px - middle) @ np.array([[cos, sin], [-sin, cos]])
    return np.asarray(turned + middle + np.array(look.shift_mm) / image.mm_per_px)


def _positions(length_px: int, pitch_px: float) -> Float64:
    """Centres along one side, symmetric about the middle, including some outside the image."""
    count = int(length_px / pitch_px) + 2 * 2  # [pitches] outside each border
    return np.asarray((length_px - 1) / 2 + from_middle(count) * pitch_px)
