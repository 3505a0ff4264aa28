"""Defects of a real rig, as options of the virtual sensor."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError


@dataclass(frozen=True)
class Faults:
    """Faults of a rig; none by default.

    Attributes
    ----------
    dim_lights : mapping of light to float
        Relative brightness of a light; 0 is a dead light.
    drift : float
        Relative amplitude of the brightness drift; each light has its own phase.
    drift_frames : int
        Period of the drift, frames.
    dust : int
        Number of specks on the glass; they do not move in the image.
    missing_markers, merged_markers : float
        Share of the printed markers that are worn off, or merged with an adjacent one.

    Raises
    ------
    InputError
        A value is out of range; the message names it.
    """

    dim_lights: Mapping[str, float] = field(default_factory=dict)
    drift: float = 0.0
    drift_frames: int = 600
    dust: int = 0
    missing_markers: float = 0.0
    merged_markers: float = 0.0

    def __post_init__(self) -> None:
        for name in ("missing_markers", "merged_markers"):
            value = getattr(self, name)
            if not 0 <= value <= 1:
                raise InputError(f"faults: {name} is a share from 0 to 1, not {value!r}")
        for name in ("dust", "drift"):
            value = getattr(self, name)
            if not value >= 0:
                raise InputError(f"faults: {name} cannot be negative, as {value!r} is")
        if self.drift_frames < 1:
            raise InputError("faults: drift_frames must be positive")

    def check_lights(self, lights: Collection[str]) -> None:
        """Raise an InputError if the rig lacks a light that these faults name."""
        unknown = sorted(self.dim_lights.keys() - lights)
        if unknown:
            raise InputError(
                f"faults: there is no light {unknown[0]!r}; the lights are {', '.join(lights)}"
            )

    def level(self, light: str, number: int, frame: int, seed: int) -> float:
        """Relative brightness of a light (the ``number``-th) in a frame."""
        level = self.dim_lights.get(light, 1.0)
        if self.drift:
            phase = np.random.default_rng([seed, 21, number]).uniform(0, 2 * np.pi)
            angle = 2 * np.pi * frame / self.drift_frames
            # No drift in frame 0, from which references are taken.
            level *= 1 + self.drift * (np.sin(angle + phase) - np.sin(phase))
        return float(max(level, 0.0))

    def draw_worn(self, count: int, seed: int) -> NDArray[np.bool_]:
        """(count,) bool: markers that are missing."""
        return np.asarray(
            np.random.default_rng([seed, 24]).random(count) < self.missing_markers, np.bool_
        )

    def draw_joined(self, centres: NDArray[np.float64], seed: int) -> NDArray[np.int_]:
        """(K, 2) pairs of merged markers: each chosen one and the nearest to it."""
        chosen = np.random.default_rng([seed, 27]).random(len(centres)) < self.merged_markers / 2
        pairs = []
        for number in np.nonzero(chosen)[0]:
            distance = np.hypot(*(centres - centres[number]).T)
            distance[number] = np.inf
            pairs.append((int(number), int(distance.argmin())))
        return np.array(pairs, int).reshape(-1, 2)

    def dusty(self, shape: tuple[int, int], seed: int) -> Float32:
        """(H, W) share of the light that passes between the specks on the glass."""
        rng = np.random.default_rng([seed, 25])
        clear = np.ones(shape, np.float32)
        for _ in range(self.dust):
            centre = (rng.uniform(0, 1, 2) * shape[::-1]).astype(int).tolist()
            radius = int(np.ceil(rng.uniform(0.002, 0.008) * shape[1]))
            share = float(rng.uniform(0.3, 0.8))  # of the light that a speck lets through
            cv2.circle(clear, centre, radius, share, -1, cv2.LINE_AA)
        sigma_px = 0.002 * shape[1] + 0.3  # of a speck's border
        return np.asarray(cv2.GaussianBlur(clear, (0, 0), sigma_px), np.float32)
