"""Whether a still frame is a press to calibrate on, by the circles of ``tactile calibrate``."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles import Circle, find_circles
from tactile_core.calibration.guided.bench import NOWHERE, Bench
from tactile_core.calibration.guided.beside import brightening, with_something_beside
from tactile_core.calibration.presses import FoundPress
from tactile_core.errors import SequenceError
from tactile_core.quantities import Frame


class EXAMINATION:
    """Limits of a press that is kept. Nothing sets them: they are ratios of lengths."""

    # [ball radii] A smaller contact shows hardly any slopes. Source: by hand, more than the
    # circle search needs (``FIT``).
    smallest_contact = 0.35
    # [ball radii] A larger one is too deep: the sides are dark, and the gel may touch its plate.
    # Source: geometry: the depth of a fifth of the diameter, which the guide asks for, gives 0.63
    # on a half-space and 0.8 if all of the cap touches, as on a thin layer.
    largest_contact = 0.78
    # [share of the gel's thickness] A ball with this contact would be too deep for the gel.
    deepest = 0.75
    # [share] Less of the contact inside the image is too little. Source: geometry: the circle is
    # whole but for a pixel's error.
    visible = 0.97
    # [ball radii] Largest standard deviation of the contact's radius. Source: chosen on virtual
    # rigs (``benchmarks/guided_calibration.py``).
    irregular = 0.12
    saturated = 0.2  # [share] Largest share of the contact that is saturated


_BESIDE = "something else touches next to the ball; press the ball alone"


@dataclass(frozen=True, eq=False)
class Verdict:
    """What the examination of a frame has found.

    Attributes
    ----------
    name : str
        Of the frame.
    circle : Circle
    why : str
        Why it is not kept; empty if it is.
    circles : mapping of str to Circle
        Those of all presses that are kept, as they are found together.
    withdrawn : mapping of str to str
        Earlier presses that are no longer kept, each with the reason.
    """

    name: str
    circle: Circle
    why: str
    circles: dict[str, Circle]
    withdrawn: dict[str, str]


class Examiner:
    """Keeps the presses of a ball, and judges each new one together with them.

    Parameters
    ----------
    bench : Bench

    Attributes
    ----------
    kept : list of FoundPress
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self.kept: list[FoundPress] = []
        self._brightening: dict[str, Float64] = {}

    def examine(self, name: str, frame: Frame) -> Verdict:
        """Judge a frame, and keep it if it is a good press."""
        try:
            press = self._bench.prepared(name, frame)
        except SequenceError as error:
            return self._verdict(name, NOWHERE, str(error))
        starts = [one.start for one in (*self.kept, press) if one.start is not None]
        *others, circle = find_circles(starts)
        press = replace(press, circle=circle)
        why = circle.why or self._flaw(press)
        if not why:
            self._brightening[name] = brightening(press)
        crowded = with_something_beside(self._brightening)
        if name in crowded:
            why = _BESIDE
        if why:
            # its presence must not change the circles of the others
            return self._verdict(name, circle, why)
        found = [replace(one, circle=c) for one, c in zip(self.kept, others, strict=True)]
        withdrawn = {one.file: one.why for one in found if not one.used}
        withdrawn |= {one.file: _BESIDE for one in found if one.file in crowded}
        self.kept = [*(one for one in found if one.file not in withdrawn), press]
        return self._verdict(name, circle, "", withdrawn)

    def _verdict(
        self, name: str, circle: Circle, why: str, withdrawn: dict[str, str] | None = None
    ) -> Verdict:
        circles = {press.file: press.circle for press in self.kept}
        return Verdict(name, circle, why, circles, withdrawn or {})

    def _flaw(self, press: FoundPress) -> str:
        """Return why a press whose circle was found is not kept; empty if it is."""
        share = press.radius_px / self._bench.touching_px
        depth_mm = (1 - np.sqrt(max(0.0, 1 - share**2))) * press.ball_diameter_mm / 2
        if visible_share(press) < EXAMINATION.visible:
            return "the image border cuts the contact; press further inside"
        if share < EXAMINATION.smallest_contact:
            return "the contact is too small; press deeper"
        deepest_mm = EXAMINATION.deepest * press.thickness_mm
        if share > EXAMINATION.largest_contact or depth_mm > deepest_mm:
            return "the contact is too large; press less deep"
        if press.circle.radius_std_px > EXAMINATION.irregular * press.ball_radius_px:
            return "the contact is not round; press the ball alone, straight down"
        contact = press.area()
        if press.frame.saturated[contact].any(axis=-1).mean() > EXAMINATION.saturated:
            return "much of the contact is saturated; press less deep, or expose for less time"
        return ""


def visible_share(press: FoundPress) -> float:
    """Return the share of the contact's disc that is inside the image."""
    h, w = press.frame.pixels.shape[:2]
    (x, y), r = press.centre_px, press.radius_px
    inside = 1.0
    for place, side in ((x, w), (y, h)):
        for distance in (place + 0.5, side - 0.5 - place):
            # share of a disc beyond a straight line at this distance from its centre
            c = float(np.clip(distance / max(r, 1e-9), -1, 1))
            inside -= (np.arccos(c) - c * np.sqrt(1 - c * c)) / np.pi
    return float(inside)
