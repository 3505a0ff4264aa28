"""What goes wrong with a real rig, as options of its virtual twin."""

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


@dataclass(frozen=True)
class Faults:
    """Faults of a rig; none by default.

    Attributes
    ----------
    dim_lights : mapping of light to float
        Brightness, of the full one: 0 is a dead lamp.
    dead_leds : mapping of light to tuple of int
        LEDs of a lamp's array that do not shine, counted from 0, row by row.
    drift : float
        How far each lamp's brightness wanders, relative; each has its own course.
    drift_frames : int
        Frames that one swing takes.
    dust : int
        Specks on the glass, at rest in the image.
    scratches : int
        Furrows in the gel, which move with the skin.
    missing_markers, merged_markers : float
        Share of the printed markers that have worn off, or have run into a neighbour.
    overexposure : float
        Factor on the light; 3 makes most rigs saturate.
    dropped_frames : float
        Share of the frames in whose stead the one before is sent again.
    torn_frames : float
        Share of the frames whose lower part is that of the frame before.
    slipped_frames : float
        Share of the observations in which the lights are one exposure late.

    Raises
    ------
    InputError
        A value that cannot be, with its name.
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
        """Refuse lights and LEDs that the rig does not have.

        Parameters
        ----------
        leds : mapping of light to int
            How many LEDs each light has.

        Raises
        ------
        InputError
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
                    f"{', '.join(map(str, dead))}; correct it or 'optics.lamps.array'"
                )

    def level(self, light: str, number: int, frame: int, seed: int) -> float:
        """Brightness of a light (the ``number``-th) in a frame, of what it should be."""
        level = self.dim_lights.get(light, 1.0)
        if self.drift:
            phase = np.random.default_rng([seed, 21, number]).uniform(0, 2 * np.pi)
            turn = 2 * np.pi * frame / self.drift_frames
            # No drift in frame 0, from which references are taken.
            level *= 1 + self.drift * (np.sin(turn + phase) - np.sin(phase))
        return float(max(level, 0.0))

    def fate(self, frame: int, seed: int) -> tuple[Fate, float]:
        """What happens to a frame, and the share of its rows above the tear."""
        rng = np.random.default_rng([seed, 22, frame])
        drop, tear, rows = rng.random(3)
        if frame > 0 and drop < self.dropped_frames:
            return "dropped", 0.0
        if frame > 0 and tear < self.torn_frames:
            return "torn", float(0.1 + 0.8 * rows)
        return "whole", 1.0

    def slips(self, frame: int, seed: int) -> bool:
        """Whether the lights of an observation are one exposure late."""
        chance = float(np.random.default_rng([seed, 23, frame]).random())
        return chance < self.slipped_frames

    def worn(self, count: int, seed: int) -> NDArray[np.bool_]:
        """(count,) bool: markers that are missing."""
        return np.asarray(
            np.random.default_rng([seed, 24]).random(count) < self.missing_markers, np.bool_
        )

    def joined(self, centres: NDArray[np.float64], seed: int) -> NDArray[np.int_]:
        """(M, 2) int: pairs of neighbouring markers that have run together."""
        chosen = np.random.default_rng([seed, 27]).random(len(centres)) < self.merged_markers / 2
        pairs = []
        for number in np.nonzero(chosen)[0]:
            distance = np.hypot(*(centres - centres[number]).T)
            distance[number] = np.inf
            pairs.append((int(number), int(distance.argmin())))
        return np.array(pairs, int).reshape(-1, 2)

    def dusty(self, shape: tuple[int, int], seed: int) -> Float32 | None:
        """(H, W) share of the light that passes the dust; None on clean glass."""
        if not self.dust:
            return None
        rng = np.random.default_rng([seed, 25])
        clear = np.ones(shape, np.float32)
        for _ in range(self.dust):
            centre = (rng.uniform(0, 1, 2) * shape[::-1]).astype(int).tolist()
            radius = int(np.ceil(rng.uniform(0.002, 0.008) * shape[1]))
            cv2.circle(clear, centre, radius, float(rng.uniform(0.3, 0.8)), -1, cv2.LINE_AA)
        return np.asarray(cv2.GaussianBlur(clear, (0, 0), 0.002 * shape[1] + 0.3), np.float32)

    def furrows_mm(self, shape: tuple[int, int], mm_per_px: float, seed: int) -> Float32 | None:
        """(H, W) relief of the scratches; None on a whole gel.

        Some ten micrometres deep and two pixels wide at least.
        """
        if not self.scratches:
            return None
        rng = np.random.default_rng([seed, 26])
        relief = np.zeros(shape, np.float32)
        for _ in range(self.scratches):
            ends = (rng.uniform(0, 1, (2, 2)) * shape[::-1]).astype(int).tolist()
            depth_mm = -float(rng.uniform(0.005, 0.015))
            cv2.line(relief, ends[0], ends[1], depth_mm, max(2, round(0.04 / mm_per_px)))
        return np.asarray(cv2.GaussianBlur(relief, (0, 0), 1.0), np.float32)
