"""Analysis of a single press: a first estimate of its centre, and whether it is a press at all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.press import Change, PressImage, change_of, working_scale
from tactile_core.algorithms.circles.symmetry import odd_centre


class StartParameters(NamedTuple):
    """Parameters of the analysis of single presses.

    Nothing sets them from outside: they are relative to the noise or the radius of the ball.

    Attributes
    ----------
    least_oddness : float, −1 to 1
        Below it the change is not that of a ball.
        Source: chosen by hand; no script derives it.
    weakest_contact : float, noise sigmas
        Below it there is no contact.
        Source: chosen by hand; no script derives it.
    strongest_elsewhere : float, ratio
        Change far from the press over that at the press; above it there is a second contact.
        Source: chosen by hand; no script derives it.
    inner_radii : float, ball radii
        Radius within which the strength of the contact is measured.
        Source: chosen by hand; no script derives it.
    far_radii : float, ball radii
        Change beyond this distance is far from the press.
        Source: chosen by hand; no script derives it.
    blur_radii : float, ball radii
        Standard deviation over which the change is averaged to compare near and far.
        Source: chosen by hand; no script derives it.
    least_blur_weight : float, ratio
        Lower bound of the sum of weights of that average, against division by zero.
        Source: chosen by hand; no script derives it.
    """

    least_oddness: float = 0.25
    weakest_contact: float = 4.0
    strongest_elsewhere: float = 0.5
    inner_radii: float = 0.6
    far_radii: float = 2.5
    blur_radii: float = 0.35
    least_blur_weight: float = 1e-3


START = StartParameters()
"""The values in use."""


@dataclass(frozen=True, eq=False)
class Start:
    """A press analysed on its own, so that many searches can share the result.

    Attributes
    ----------
    change : Change
    ball : float
        Radius of the ball in working pixels.
    centre : (2,) float64
        Point about which the change is most odd, in working pixels.
    oddness : float
        −1 (even) to 1 (odd).
    why : str
        Reason to exclude the press; "" if there is none.
    """

    change: Change
    ball: float
    centre: Float64
    oddness: float
    why: str

    @classmethod
    def of(cls, image: PressImage, ball_radius_px: float, scale: float | None = None) -> Start:
        """Analyse one press of a ball of this radius, at the working scale of the whole set."""
        scale = working_scale(ball_radius_px) if scale is None else scale
        ball = ball_radius_px * scale
        change = change_of(image, scale)
        centre, odd = _most_odd(change, ball)
        return cls(change, ball, centre, odd, _unlike_a_press(change, centre, odd, ball))


def _most_odd(change: Change, ball: float) -> tuple[Float64, float]:
    """Point about which the change is most odd, and its oddness."""
    found = odd_centre(change, ball)
    if found[1] >= START.least_oddness:
        return found
    # Lights at a high elevation dim on every slope, which is even; the difference between the
    # channels is not.
    return max(found, odd_centre(change.between_channels(), ball), key=lambda start: start[1])


def _unlike_a_press(change: Change, start: Float64, odd: float, ball: float) -> str:
    """Reason to exclude the press because of its own change; "" if there is none."""
    x, y = change.disc(start, START.inner_radii * ball)
    if len(x) == 0:
        return "no contact: markers hide the gel surface where the image changed"
    strength = float(np.sqrt((change.values[y, x] ** 2).sum(1).mean())) / change.noise
    if strength < START.weakest_contact:
        return "no contact: the change is barely above the noise"
    if odd < START.least_oddness:
        return "not a ball: the change is not antisymmetric about any centre"
    if _elsewhere(change, start, ball) > START.strongest_elsewhere:
        return "not one ball: something else touches, or the gel or the light has changed"
    return ""


def _elsewhere(change: Change, start: Float64, ball: float) -> float:
    """Strongest change far from the press, over the strongest within one ball radius."""
    energy = (change.values**2).sum(2) * change.weight
    sigma = START.blur_radii * ball
    total = np.maximum(cv2.GaussianBlur(change.weight, (0, 0), sigma), START.least_blur_weight)
    local = cv2.GaussianBlur(energy, (0, 0), sigma) / total
    h, w = local.shape
    distance = np.hypot(np.arange(w) - start[0], np.arange(h)[:, None] - start[1])
    far = local[distance > START.far_radii * ball]
    near = local[distance < ball]
    return float(np.sqrt(far.max() / near.max())) if far.size and near.size else 0.0
