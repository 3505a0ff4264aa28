"""Analysis of a single press: a first estimate of its centre, and whether it is a press at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import sigma_of
from tactile_core.algorithms.arrays.types import Array, Bool, Float64
from tactile_core.algorithms.circles.circle import odd_centre, oddness_at
from tactile_core.algorithms.circles.press import PressChange, PressImage, change_of, working_scale


class START:
    """Parameters of the analysis of single presses.

    Nothing sets them from outside: they are relative to the noise or the radius of the ball.
    """

    least_oddness = 0.25  # [−1 to 1] Below it the change is not that of a ball
    # [change] With a larger change of the undeformed surface, the light is not that of the
    # reference. Source: half of the largest log gain that is compensated
    # (``algorithms/light/drift.py``).
    largest_drift = 0.05
    # [ball radii] Standard deviation over which the change is averaged to compare near and far.
    blur_radii = 0.35
    # [count] About the number of pixels of which a median is taken. Source: by hand, a median is
    # then within some per cent of the noise.
    most_pixels = 5000


# Reason to exclude a press under another light.
DIFFERS = (
    "far from the contact the light is not that of the reference: the ball shades the gel there, "
    "or light, exposure or crop have changed; press nearer to the middle, or record a new reference"
)


@dataclass(frozen=True, eq=False)
class Sighting:
    """A press on its own, as light from the sides or a darkening with depth would show it.

    Attributes
    ----------
    change : PressChange
        What is odd about the centre: the change of the image, or the gradient of that.
    centre : (2,) float64
        Point about which it is most odd, in working pixels.
    oddness : float
        −1 (even) to 1 (odd).
    why : str
        Reason to exclude the press; "" if there is none.
    """

    change: PressChange
    centre: Float64
    oddness: float
    why: str


@dataclass(frozen=True, eq=False)
class Start:
    """A press analysed on its own, so that many searches can share the result.

    Attributes
    ----------
    ball : float
        Radius of the ball in working pixels.
    shading, darkening : Sighting
        The press under light from the sides, and under light that fades with depth.
    """

    ball: float
    shading: Sighting
    darkening: Sighting

    @classmethod
    def from_image(
        cls, image: PressImage, ball_radius_px: float, scale: float | None = None
    ) -> Start:
        """Analyse one press of a ball of this radius, at the working scale of the whole set."""
        scale = working_scale(ball_radius_px) if scale is None else scale
        ball = ball_radius_px * scale
        change = change_of(image, scale)
        gradient = change.gradient(ball)
        return cls(
            ball,
            _sighting(change, None, *_most_odd(change, ball), ball),
            _sighting(change, gradient, *odd_centre(gradient, ball), ball),
        )

    def refuse_press(self, why: str) -> Start:
        """Return it as no press, for a reason that the whole image gives."""
        shading, darkening = (replace(one, why=why) for one in (self.shading, self.darkening))
        return Start(self.ball, shading, darkening)

    def choose_sighting(self, *, darkens: bool) -> Sighting:
        """Return the sighting for one kind of light."""
        return self.darkening if darkens else self.shading


def darkens(starts: Sequence[Start]) -> bool:
    """Whether presses darken with depth: they are even about the centre of their gradient."""
    seen = [start for start in starts if not start.darkening.why] or starts
    odd = [oddness_at(s.shading.change, s.darkening.centre, s.ball) for s in seen]
    # [−1 to 1] Below it presses are even, as where the image darkens with depth. Source: virtual
    # units (``experiments/circle_finding.py``): −0.99 to −1 where they darken, −0.75 and more with
    # light from the sides.
    return bool(odd) and float(np.median(odd)) < -0.9


def _sighting(
    change: PressChange,
    gradient: PressChange | None,
    centre: Float64,
    oddness: float,
    ball: float,
) -> Sighting:
    """Remove the change of the light, and judge whether this is a press."""
    h, w = change.shape
    distance = np.hypot(np.arange(w) - centre[0], np.arange(h)[:, None] - centre[1])
    # [ball radii] Beyond this distance from the centre the gel surface counts as undeformed.
    far = (distance > 2.0 * ball) & (change.weight > 0)
    # [share] With a smaller share of the image there, a change of the light is not estimated.
    if np.count_nonzero(far) < 0.1 * far.size:
        far[...] = False
    drift = _median(change, far)
    change = change.subtract_drift(drift)
    why = _unlike_a_press(change, centre, far, drift, ball)
    if not why and oddness < START.least_oddness:
        why = "not a ball: the change is not symmetric about any centre"
    # [ratio] Change far from the press over that at the press; above it there is a second contact.
    if not why and _elsewhere(change, centre, ball) > 0.5:
        why = "not one ball: something else touches, or the gel or the light has changed"
    return Sighting(gradient or change, centre, oddness, why)


def _median(change: PressChange, where: Bool) -> Float64:
    """Median change (K,) of some pixels; 0 of none."""
    rows, columns = np.nonzero(where)
    if not len(rows):
        return np.zeros(change.values.shape[2])
    values, _, _ = change.values_at(_thin_values(columns), _thin_values(rows))
    return np.median(values, axis=1).astype(np.float64)


def _thin_values(values: Array) -> Array:
    """Every n-th of (N,) values, enough for a median."""
    return values[:: max(1, len(values) // START.most_pixels)]


def _step(pixels: int) -> int:
    """Rows and columns per pixel of an image that are enough for a median."""
    return max(1, int(np.sqrt(pixels / START.most_pixels)))


def _most_odd(change: PressChange, ball: float) -> tuple[Float64, float]:
    """Point about which the change is most odd, and its oddness."""
    found = odd_centre(change, ball)
    if found[1] >= START.least_oddness:
        return found
    # Lights at a high elevation dim on every slope, which is even; the difference between the
    # channels is not.
    return max(found, odd_centre(change.between_channels(), ball), key=lambda start: start[1])


def _unlike_a_press(
    change: PressChange, centre: Float64, far: Bool, drift: Float64, ball: float
) -> str:
    """Reason to exclude the press because of the strength of its change; "" if there is none."""
    # [ball radii] Radius within which the strength of the contact is measured
    x, y = change.disc(centre, 0.6 * ball)
    if len(x) == 0:
        return "no contact: markers hide the gel surface where the image changed"
    length = np.sqrt(change.energy)
    step = _step(change.weight.size)
    expected = np.sqrt(change.noise_variance[::step, ::step].sum(2))
    noise = sigma_of(_thin_values(length[far])) if far.any() else float(np.median(expected))
    moved = float(np.abs(drift).max())
    # beside noise: three times that of the camera
    differs = moved > max(START.largest_drift, 3.0 * float(np.median(expected)))
    if differs:
        return DIFFERS
    strength = float(np.sqrt((length[y, x] ** 2).mean()))
    # [noise sigmas] Below it there is no contact
    if strength <= 4.0 * noise:  # both are 0 in the reference itself
        return "no contact: the change is barely above the noise"
    return ""


def _elsewhere(change: PressChange, start: Float64, ball: float) -> float:
    """Strongest change far from the press, over the strongest within one ball radius."""
    sigma = START.blur_radii * ball
    # bounded from below against division by zero
    total = np.maximum(cv2.GaussianBlur(change.weight, (0, 0), sigma), 1e-3)
    local = cv2.GaussianBlur(change.energy, (0, 0), sigma) / total
    h, w = local.shape
    distance = np.hypot(np.arange(w) - start[0], np.arange(h)[:, None] - start[1])
    # [ball radii] Change beyond this distance is far from the press
    far = local[distance > 2.5 * ball]
    near = local[distance < ball]
    return float(np.sqrt(far.max() / near.max())) if far.size and near.size else 0.0
