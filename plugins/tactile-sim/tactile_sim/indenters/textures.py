"""Textured objects in closed form: coin, screw, letters, cloth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.errors import InputError
from tactile_sim.indenters.mesh import HeightMapIndenter
from tactile_sim.indenters.solids import FAR_MM, Indenter, positive, round_gap


@dataclass(frozen=True)
class Coin(Indenter):
    """A coin's face: a raised rim, a ring of beads, and a star in the middle.

    Parameters
    ----------
    diameter_mm : float
    relief_mm : float
        Height of the relief above the field.
    """

    diameter_mm: float = 14.0
    relief_mm: float = 0.15

    def __post_init__(self) -> None:
        positive("a coin's diameter_mm", self.diameter_mm)
        positive("a coin's relief_mm", self.relief_mm)

    @property
    def detail_mm(self) -> float | None:
        """Width of the rim."""
        return 0.03 * self.diameter_mm

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        radius = self.diameter_mm / 2
        r, angle = np.hypot(x_mm, y_mm) / radius, np.arctan2(y_mm, x_mm)
        # in radii of the coin: edges of 0.015, a rim, 48 beads on a ring, a star of five points
        rim = _step((r - 0.93) / 0.015)
        along = (angle * 48 / (2 * np.pi) + 0.5) % 1 - 0.5
        outward = (r - 0.86) * 48 / (2 * np.pi * 0.86)
        bead = _step((0.35 - np.hypot(along, outward)) / 0.1)
        outline = 0.42 + 0.16 * np.cos(5 * angle)
        star = _step((outline - r) / 0.015)
        raised = np.maximum(np.maximum(rim, bead), star)
        return np.asarray(np.where(r < 1, self.relief_mm * (1 - raised), FAR_MM))


@dataclass(frozen=True)
class Screw(Indenter):
    """A threaded rod on its side; its axis is along the object's x.

    Parameters
    ----------
    diameter_mm : float
        Major diameter; M6 by default.
    pitch_mm : float
        Thread pitch.
    length_mm : float
    """

    diameter_mm: float = 6.0
    pitch_mm: float = 1.0
    length_mm: float = 14.0

    def __post_init__(self) -> None:
        for name in ("diameter_mm", "pitch_mm", "length_mm"):
            positive(f"a screw's {name}", getattr(self, name))
        if self.pitch_mm > self.diameter_mm / 2:
            raise InputError("a screw's pitch_mm should be no more than half its diameter_mm")

    @property
    def detail_mm(self) -> float | None:
        """Width of a crest."""
        return self.pitch_mm / 8

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        # ISO metric thread: flanks of 60°, crests an eighth of the pitch wide, roots a quarter
        radius = self.diameter_mm / 2
        turn = np.arcsin(np.clip(y_mm / radius, -1, 1)) / (2 * np.pi)
        phase = np.abs((x_mm / self.pitch_mm + turn + 0.5) % 1 - 0.5)
        depth = np.clip((phase - 1 / 16) * np.sqrt(3), 0, 5 / 8 * np.sqrt(3) / 2) * self.pitch_mm
        inside = np.abs(x_mm) < self.length_mm / 2
        return np.asarray(np.where(inside, round_gap(np.abs(y_mm), radius) + depth, FAR_MM))


@dataclass(frozen=True)
class Cloth(Indenter):
    """Plain weave: threads that pass over and under each other, on a flat backing.

    Parameters
    ----------
    pitch_mm : float
        Distance between adjacent threads.
    thread_mm : float, optional
        Thickness of a thread. Default: 0.4 of the pitch, chosen by hand.
    size_mm : float
        Side of the square patch.
    """

    pitch_mm: float = 0.8
    thread_mm: float | None = None
    size_mm: float = 14.0

    def __post_init__(self) -> None:
        positive("a cloth's pitch_mm", self.pitch_mm)
        positive("a cloth's size_mm", self.size_mm)
        if self.thread_mm is not None:
            positive("a cloth's thread_mm", self.thread_mm)

    @property
    def detail_mm(self) -> float | None:
        """Half the thread pitch."""
        return self.pitch_mm / 2

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        thread = self.thread_mm if self.thread_mm is not None else 0.4 * self.pitch_mm
        gap = weave_gap(x_mm, y_mm, self.pitch_mm, thread)
        inside = np.maximum(np.abs(x_mm), np.abs(y_mm)) < self.size_mm / 2
        return np.asarray(np.where(inside, gap, FAR_MM))


def weave_gap(x_mm: Array, y_mm: Array, pitch_mm: float, thread_mm: float) -> Array:
    """Depth of a plain weave below its highest points, mm."""
    wave_x, wave_y = np.pi * x_mm / pitch_mm, np.pi * y_mm / pitch_mm
    # a thread along x at every pitch of y; it is on top at every second crossing
    top_x = np.cos(wave_x) * np.cos(wave_y) * np.abs(np.cos(wave_y))
    top_y = -np.cos(wave_x) * np.cos(wave_y) * np.abs(np.cos(wave_x))
    return np.asarray(0.5 * thread_mm * (1 - np.maximum(top_x, top_y)))


def letters(
    text: str = "GEL", *, size_mm: float = 5.0, relief_mm: float = 0.25, mm_per_px: float = 0.05
) -> HeightMapIndenter:
    """Return a plate with raised letters, readable from the camera's side.

    Parameters
    ----------
    text : str
        Printable ASCII.
    size_mm : float
        Height of a capital letter.
    relief_mm : float
        Height of the letters above the plate.
    mm_per_px : float
        Spacing of the height map's points.
    """
    import cv2

    if not text.strip() or not text.isascii() or not text.isprintable():
        raise InputError(f"letters should be printable ASCII, not {text!r}")
    for name, value in (("size_mm", size_mm), ("relief_mm", relief_mm), ("mm_per_px", mm_per_px)):
        positive(f"the letters' {name}", value)
    font = cv2.FONT_HERSHEY_SIMPLEX
    scale = size_mm / mm_per_px / 21.0  # px: height of a capital of this font at scale 1
    stroke = max(round(0.14 * size_mm / mm_per_px), 1)
    (width, height), _ = cv2.getTextSize(text, font, scale, stroke)
    margin = 2 * stroke
    plate = np.zeros((height + 2 * margin, width + 2 * margin), np.uint8)
    cv2.putText(plate, text, (margin, margin + height), font, scale, 255, stroke, cv2.LINE_AA)
    sigma_px = max(stroke / 6, 0.5)  # rounds the edges
    blurred = cv2.GaussianBlur(plate.astype(np.float64) / 255, (0, 0), sigma_px)
    return HeightMapIndenter(relief_mm * blurred, mm_per_px)


def _step(value: Array) -> Array:
    """Smooth step: 0 below −1, 1 above 1."""
    t = np.clip((value + 1) / 2, 0, 1)
    return np.asarray(t * t * (3 - 2 * t))
