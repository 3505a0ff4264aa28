"""Defects of a real rig, as options of the virtual sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError

Fate = Literal["whole", "dropped", "torn"]

_SHARES = ("missing_markers", "merged_markers", "dropped_frames", "torn_frames", "slipped_frames")
_COUNTS = ("dust", "scratches")


# [float), share of the rows] Smallest row of a tear, and the range above it
_TEAR_ROWS = (0.1, 0.8)
_DUST_RADIUS = (0.002, 0.008)  # [float), share of the image width] Range of a speck's radius
_DUST_CLEAR = (0.3, 0.8)  # [float), share of the light] Range of a speck's transmission
# [share of the image width; float, px] Gaussian sigma of a speck's border: the first times the
# width, plus the second
_DUST_BLUR = 0.002
_DUST_BLUR_PX = 0.3
_SCRATCH_DEPTH_MM = (0.005, 0.015)  # [float), mm] Range of a scratch's depth
_SCRATCH_WIDTH_MM = 0.04  # [mm; int, px] Width of a scratch, and the smallest width that is drawn
_SCRATCH_WIDTH_PX = 2
_SCRATCH_BLUR_PX = 1.0  # [px] Gaussian sigma of a scratch's profile


@dataclass(frozen=True)
class Faults:
    """Faults of a rig; none by default.

    Attributes
    ----------
    dim_lights : mapping of light to float
        Relative brightness of a light; 0 is a dead light.
    dead_leds : mapping of light to tuple of int
        Indices of dead LEDs in a light's array, row by row from 0.
    drift : float
        Relative amplitude of the brightness drift; each light has its own phase.
    drift_frames : int
        Period of the drift, frames.
    dust : int
        Number of specks on the glass; they do not move in the image.
    scratches : int
        Number of scratches in the gel; they move with its surface.
    missing_markers, merged_markers : float
        Share of the printed markers that are worn off, or merged with an adjacent one.
    overexposure : float
        Factor on the light; 3 saturates most rigs.
    dropped_frames : float
        Share of the frames that repeat the previous one.
    torn_frames : float
        Share of the frames whose lower part comes from the previous one.
    slipped_frames : float
        Share of the observations whose lights are one exposure late.

    Raises
    ------
    InputError
        A value is out of range; the message names it.
    """

    dim_lights: Mapping[str, float] = field(default_factory=dict)
    dead_leds: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    drift: float = 0.0
    drift_frames: int = 600
    dust: int = 0
    scratches: int = 0
    missing_markers: float = 0.0
    merged_markers: float = 0.0
    overexposure: float = 1.0
    dropped_frames: float = 0.0
    torn_frames: float = 0.0
    slipped_frames: float = 0.0

    def __post_init__(self) -> None:
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        for name in _SHARES:
            if not 0 <= values[name] <= 1:
                raise InputError(f"faults: {name} is a share from 0 to 1, not {values[name]!r}")
        for name in (*_COUNTS, "drift"):
            if not values[name] >= 0:
                raise InputError(f"faults: {name} cannot be negative, as {values[name]!r} is")
        if not self.overexposure > 0 or self.drift_frames < 1:
            raise InputError("faults: overexposure and drift_frames must be positive")

    def check_lights(self, leds: Mapping[str, int]) -> None:
        """Check that the rig has all lights and LEDs that these faults name.

        Parameters
        ----------
        leds : mapping of light to int
            Number of LEDs of each light.

        Raises
        ------
        InputError
            The rig lacks one of them.
        """
        unknown = sorted({*self.dim_lights, *self.dead_leds} - leds.keys())
        if unknown:
            raise InputError(
                f"faults: there is no light {unknown[0]!r}; the lights are {', '.join(leds)}"
            )
        for name, dead in self.dead_leds.items():
            if not all(0 <= number < leds[name] for number in dead):
                raise InputError(
                    f"faults: light {name!r} has LEDs 0 to {leds[name] - 1}, and dead_leds names "
                    f"{', '.join(map(str, dead))}; correct it or 'optics.lights.array'"
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

    def fate(self, frame: int, seed: int) -> tuple[Fate, float]:
        """Fate of a frame, and the share of its rows above the tear."""
        if not (self.dropped_frames or self.torn_frames):
            return "whole", 1.0
        rng = np.random.default_rng([seed, 22, frame])
        drop, tear, rows = rng.random(3)
        if frame > 0 and drop < self.dropped_frames:
            return "dropped", 0.0
        if frame > 0 and tear < self.torn_frames:
            first, span = _TEAR_ROWS
            return "torn", float(first + span * rows)
        return "whole", 1.0

    def slips(self, frame: int, seed: int) -> bool:
        """Whether the lights of an observation are one exposure late."""
        if not self.slipped_frames:
            return False
        sample = float(np.random.default_rng([seed, 23, frame]).random())
        return sample < self.slipped_frames

    def draw_worn(self, count: int, seed: int) -> NDArray[np.bool_]:
        """(count,) bool: markers that are missing."""
        return np.asarray(
            np.random.default_rng([seed, 24]).random(count) < self.missing_markers, np.bool_
        )

    def draw_joined(self, centres: NDArray[np.float64], seed: int) -> NDArray[np.int_]:
        """(M, 2) int: pairs of adjacent markers that have merged."""
        chosen = np.random.default_rng([seed, 27]).random(len(centres)) < self.merged_markers / 2
        pairs = []
        for number in np.nonzero(chosen)[0]:
            distance = np.hypot(*(centres - centres[number]).T)
            distance[number] = np.inf
            pairs.append((int(number), int(distance.argmin())))
        return np.array(pairs, int).reshape(-1, 2)

    def dusty(self, shape: tuple[int, int], seed: int) -> Float32 | None:
        """(H, W) transmission of the dust; None on clean glass."""
        if not self.dust:
            return None
        rng = np.random.default_rng([seed, 25])
        clear = np.ones(shape, np.float32)
        for _ in range(self.dust):
            centre = (rng.uniform(0, 1, 2) * shape[::-1]).astype(int).tolist()
            radius = int(np.ceil(rng.uniform(*_DUST_RADIUS) * shape[1]))
            share = float(rng.uniform(*_DUST_CLEAR))
            cv2.circle(clear, centre, radius, share, -1, cv2.LINE_AA)
        sigma_px = _DUST_BLUR * shape[1] + _DUST_BLUR_PX
        return np.asarray(cv2.GaussianBlur(clear, (0, 0), sigma_px), np.float32)

    def scratches_mm(self, shape: tuple[int, int], mm_per_px: float, seed: int) -> Float32 | None:
        """(H, W) relief of the scratches, negative; None without scratches."""
        if not self.scratches:
            return None
        rng = np.random.default_rng([seed, 26])
        relief = np.zeros(shape, np.float32)
        width_px = max(_SCRATCH_WIDTH_PX, round(_SCRATCH_WIDTH_MM / mm_per_px))
        for _ in range(self.scratches):
            ends = (rng.uniform(0, 1, (2, 2)) * shape[::-1]).astype(int).tolist()
            depth_mm = -float(rng.uniform(*_SCRATCH_DEPTH_MM))
            cv2.line(relief, ends[0], ends[1], depth_mm, width_px)
        return np.asarray(cv2.GaussianBlur(relief, (0, 0), _SCRATCH_BLUR_PX), np.float32)
