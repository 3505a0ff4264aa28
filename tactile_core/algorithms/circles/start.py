"""What one press alone tells: where to start its search, and whether it is a press at all."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.press import Change, PressImage, change_of, working_scale
from tactile_core.algorithms.circles.symmetry import odd_centre

FEWEST_ODD = 0.25
STRONGEST_ELSEWHERE = 0.5
"""Change far from a press, relative to the press's own; more is a second contact."""

WEAKEST_CONTACT = 4.0


@dataclass(frozen=True, eq=False)
class Start:
    """A press before any other is looked at, so that it may be kept for many searches.

    Attributes
    ----------
    change : Change
    ball : float
        Radius of the ball in working pixels.
    centre : (2,) float64
        About which the change is most odd, in working pixels.
    oddness : float
    why : str
        Why the press alone rules itself out; "" if it does not.
    """

    change: Change
    ball: float
    centre: Float64
    oddness: float
    why: str

    @classmethod
    def of(cls, image: PressImage, ball_radius_px: float) -> Start:
        """Look at one press of a ball of this radius."""
        scale = working_scale(ball_radius_px)
        ball = ball_radius_px * scale
        change = change_of(image, scale)
        centre, odd = _most_odd(change, ball)
        return cls(change, ball, centre, odd, _unlike_a_press(change, centre, odd, ball))


def _most_odd(change: Change, ball: float) -> tuple[Float64, float]:
    """Centre about which the change is most odd, and how odd it is."""
    found = odd_centre(change, ball)
    if found[1] >= FEWEST_ODD:
        return found
    # Lamps that stand high all dim on every slope, which is even; between the channels nothing is.
    return max(found, odd_centre(change.between_channels(), ball), key=lambda start: start[1])


def _unlike_a_press(change: Change, start: Float64, odd: float, ball: float) -> str:
    """Why the change alone rules a press out; "" if it does not."""
    x, y = change.disc(start, 0.6 * ball)
    if len(x) == 0:
        return "no contact: the skin is hidden where something changed"
    strength = float(np.sqrt((change.values[y, x] ** 2).sum(1).mean())) / change.noise
    if strength < WEAKEST_CONTACT:
        return "no contact: the change is hardly above the noise"
    if odd < FEWEST_ODD:
        return "not a ball: the change is not odd about any centre"
    if _elsewhere(change, start, ball) > STRONGEST_ELSEWHERE:
        return "not one ball: something else touches, or the gel or the light has changed"
    return ""


def _elsewhere(change: Change, start: Float64, ball: float) -> float:
    """Strongest change beyond 2.5 ball radii, relative to the strongest within one."""
    energy = (change.values**2).sum(2) * change.weight
    sigma = 0.35 * ball
    total = np.maximum(cv2.GaussianBlur(change.weight, (0, 0), sigma), 1e-3)
    local = cv2.GaussianBlur(energy, (0, 0), sigma) / total
    h, w = local.shape
    distance = np.hypot(np.arange(w) - start[0], np.arange(h)[:, None] - start[1])
    far = local[distance > 2.5 * ball]
    near = local[distance < ball]
    return float(np.sqrt(far.max() / near.max())) if far.size and near.size else 0.0
