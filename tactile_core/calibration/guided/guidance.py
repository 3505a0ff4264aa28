"""What guided calibration says to a person after each frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tactile_core.algorithms.circles import Circle

# What the person should do: let go, press at the target, hold still, lift, or nothing more.
State = Literal["hands_off", "press", "hold", "lift", "done"]


@dataclass(frozen=True, eq=False)
class Guidance:
    """Plain data after one frame; a view draws it as it likes.

    Attributes
    ----------
    say : str
        One sentence: what to do now.
    state : {"hands_off", "press", "hold", "lift", "done"}
    target_px : (float, float) or None
        Where to press next; None before the undeformed gel was seen, and when all is done.
    target_radius_px : float
        Press until the contact is as large as this circle.
    imprint_px : (float, float) or None
        Middle of what touches now.
    circle : Circle or None
        Contact circle of the press that was examined last.
    kept : int
        Presses that are kept.
    attempts : int
        Touches that have ended, or were judged.
    refused : str or None
        Why the last press was not kept; None if it was, or is being examined.
    examining : bool
        A press is being examined.
    coverage : (rows, columns) float64
        How well each part of the view is covered, 0 to 1.
    slope_coverage : (rings, regions) float64
        Share of the presses with slopes of each ring of steepness, in each region of the view.
    held_out : float or None
        Mean error of the normals of the latest presses, degrees: each with a calibration on those
        before it.
    held_out_each : tuple of float
        The same error of each press that was scored, in order.
    warning : str or None
        What is wrong beside the presses, such as a light that has changed.
    done : bool
        More presses would not help.
    """

    say: str
    state: State
    target_px: tuple[float, float] | None
    target_radius_px: float
    imprint_px: tuple[float, float] | None
    circle: Circle | None
    kept: int
    attempts: int
    refused: str | None
    examining: bool
    coverage: np.ndarray
    slope_coverage: np.ndarray
    held_out: float | None
    held_out_each: tuple[float, ...]
    warning: str | None
    done: bool

    def summary(self) -> dict[str, Any]:
        """Return the line of ``tactile calibrate --live --json``: strict JSON."""
        circle = self.circle
        return {
            "say": self.say,
            "state": self.state,
            "target_px": None if self.target_px is None else [round(v, 1) for v in self.target_px],
            "target_radius_px": round(self.target_radius_px, 1),
            "circle": None
            if circle is None
            else {
                "centre_px": [round(v, 2) for v in circle.centre_px],
                "contact_radius_px": round(circle.contact_radius_px, 2),
            },
            "kept": self.kept,
            "attempts": self.attempts,
            "refused": self.refused,
            "coverage": round(float((self.coverage >= 1).mean()), 4),
            "slope_coverage": round(float(self.slope_coverage.mean()), 4),
            "held_out": None if self.held_out is None else round(self.held_out, 4),
            "warning": self.warning,
            "done": self.done,
        }
