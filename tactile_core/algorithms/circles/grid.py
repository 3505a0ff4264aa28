"""Circles of many balls in one frame, from centres that somebody drew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial
from tactile_core.algorithms.arrays.types import Bool, Float32, Float64
from tactile_core.algorithms.circles.finder import MOST_MISFIT, SMALLEST_CONTACT, Circle
from tactile_core.algorithms.circles.press import PressImage, disc
from tactile_core.algorithms.photometric import Smoothing, place, relative_change

_BLUR_BALLS, _LEAST_BLUR_PX = 0.1, 1.2
_SAMPLES = 12_000
_FEWEST = 30
_REACHES = (0.5, 0.65, 0.8, 0.85, 0.85, 0.85)
"""The centres are refined on more and more of the balls, in ball radii, while they touch."""
_FARTHEST_STEP = 0.25
_MANY_BALLS = 12
"""With fewer, terms of the place would follow the centres as they were drawn, and even terms their
common shift: then the sines are odd in the change, and blind to the place."""
_STEP = 0.05
_FALLEN = 0.88
"""Beyond the contact the slope falls behind the ball's by more than this."""


@dataclass(frozen=True, eq=False)
class GridLight:
    """The light of the balls of a grid: how others in the same frame are found by it.

    Attributes
    ----------
    steps : sequence of (PolynomialFit, float)
        Sines as a polynomial of colour and perhaps place, and the reach in ball radii within which
        it is used, from rough to fine.
    misfit : float
        Usual for a ball.
    contact : float
        Radius to which the skin follows the balls, in theirs.
    with_place : bool
        Whether the polynomials are of the place, too.
    """

    steps: Sequence[tuple[PolynomialFit, float]]
    misfit: float
    contact: float
    with_place: bool

    def locate(self, image: PressImage, centres_px: Float64, ball_radius_px: float) -> list[Circle]:
        """Refine the circles of balls that this light was not fitted to."""
        balls = _Balls.of(image, centres_px, ball_radius_px, self.with_place)
        misfits = np.full(len(balls.centres), np.inf)
        for light, reach in self.steps:
            misfits = balls.move(light, reach)
        return self.circles(balls.centres, misfits, ball_radius_px)

    def circles(self, centres_px: Float64, misfits: Float64, ball_radius_px: float) -> list[Circle]:
        """Circles of balls that were moved by this light, or why they are of no use."""
        found = []
        for (x, y), misfit in zip(centres_px, misfits, strict=True):
            why = ""
            if not np.isfinite(misfit):
                why = "it lies outside the image"
            elif misfit > MOST_MISFIT * self.misfit:
                why = "its colours are not those of the other balls"
            elif self.contact < SMALLEST_CONTACT:
                why = "the contact is too small to calibrate on; press deeper"
            radius_px = self.contact * ball_radius_px
            found.append(Circle((float(x), float(y)), radius_px, not why, why, float(not why)))
        return found


def refine_grid(
    image: PressImage, centres_px: Float64, ball_radius_px: float
) -> tuple[list[Circle], GridLight]:
    """Refine the circles of many balls in one frame, from centres good to a fifth of the radius.

    One polynomial of colour and place is fitted to the sines (p − c) / R of all balls together, and
    each ball's centre then is where the fitted sines vanish, in turn: what is drawn a little to the
    left on one ball is drawn to the right on another, so the polynomial sides with neither.

    Parameters
    ----------
    image : PressImage
    centres_px : (N, 2) float
        x, y.
    ball_radius_px : float
        Radius of the balls themselves.

    Returns
    -------
    circles : list of Circle, in the order of the centres
    light : GridLight
        Finds others in the same frame.
    """
    many = len(centres_px) >= _MANY_BALLS
    balls = _Balls.of(image, centres_px, ball_radius_px, many)
    contact = 1.0
    steps = []
    misfits = np.full(len(balls.centres), np.inf)
    for planned in _REACHES:
        reach = min(planned, max(contact, SMALLEST_CONTACT))
        light = balls.fitted(reach, many)
        misfits = balls.move(light, reach)
        contact = balls.contact(light, reach)
        steps.append((light, reach))
    seen = misfits[np.isfinite(misfits)]
    common = GridLight(tuple(steps), float(np.median(seen)) if len(seen) else 0.0, contact, many)
    return common.circles(balls.centres, misfits, ball_radius_px), common


class _Balls:
    """Balls of a frame while their centres are refined."""

    def __init__(self, features: Float32, surface: Bool, centres: Float64, radius: float) -> None:
        self._features, self._surface, self._radius = features, surface, radius
        self.centres = centres

    @classmethod
    def of(cls, image: PressImage, centres_px: Float64, radius_px: float, with_place: bool) -> Self:
        """Prepare a frame: its relative change, and perhaps the place."""
        smoothing = Smoothing.of(image.marker_mask, max(_LEAST_BLUR_PX, _BLUR_BALLS * radius_px))
        features = relative_change(
            smoothing.apply(image.pixels, image.marker_mask),
            np.asarray(smoothing.apply(image.reference, image.marker_mask), np.float32),
            full_scale=image.full_scale,
        )
        if with_place:
            features = np.concatenate([features, place(features.shape[:2])], axis=2)
        surface = (
            np.ones(features.shape[:2], bool) if image.marker_mask is None else ~image.marker_mask
        )
        return cls(features, surface, np.array(centres_px, float), radius_px)

    def _disc(self, centre: Float64, reach: float) -> tuple[Float32, Float64]:
        """Features and (N, 2) place in ball radii of the skin within ``reach`` of a centre."""
        x, y = disc(self._surface, centre, reach * self._radius)
        return self._features[y, x], (np.stack([x, y], 1) - centre) / self._radius

    def fitted(self, reach: float, many: bool) -> PolynomialFit:
        """Sines as a polynomial of colour and, for many balls, place."""
        discs = [self._disc(centre, reach) for centre in self.centres]
        features = np.concatenate([f for f, _ in discs])
        offsets = np.concatenate([o for _, o in discs])
        pick = np.random.default_rng(0).permutation(len(features))[:_SAMPLES]
        seen, normal_xy = features[pick], offsets[pick].astype(np.float32)
        if many:
            return fit_polynomial(seen, normal_xy, order=2, ridge=1e-3)
        # Seen from the other side of its centre a ball changes the other way.
        return fit_polynomial(
            np.concatenate([seen, -seen]),
            np.concatenate([normal_xy, -normal_xy]),
            order=1,
            ridge=1e-3,
        )

    def move(self, light: PolynomialFit, reach: float) -> Float64:
        """Put each centre where its sines vanish; (N,) misfit of each ball, inf where unseen."""
        misfits = np.full(len(self.centres), np.inf)
        for i, centre in enumerate(self.centres):
            features, offsets = self._disc(centre, reach)
            if len(features) < _FEWEST:
                continue
            normal_xy = light(features).astype(np.float64)
            spread = offsets - offsets.mean(0)
            scale = float((spread * normal_xy).sum() / (spread * spread).sum())
            shift = offsets.mean(0) - normal_xy.mean(0) / (scale if abs(scale) > 0.1 else 1.0)
            misfits[i] = np.sqrt(((normal_xy - scale * (offsets - shift)) ** 2).sum(1).mean())
            self.centres[i] = centre + self._radius * np.clip(
                shift, -_FARTHEST_STEP, _FARTHEST_STEP
            )
        return misfits

    def contact(self, light: PolynomialFit, reach: float) -> float:
        """Radius to which the skin follows the balls as it does within ``reach``; ball radii."""
        discs = [self._disc(centre, 1.0) for centre in self.centres]
        offsets = np.concatenate([o for _, o in discs])
        normal_xy = np.concatenate([light(f) for f, _ in discs])
        place_ = np.hypot(offsets[:, 0], offsets[:, 1])
        along = (normal_xy * offsets).sum(1) / np.maximum(place_, 1e-6)
        inside = place_ < reach
        usual = float((along[inside] @ place_[inside]) / (place_[inside] @ place_[inside]))
        last = SMALLEST_CONTACT - _STEP
        width = max(_STEP / 2, 0.75 / self._radius)
        for ring in np.arange(SMALLEST_CONTACT, 1.0, _STEP):
            near = np.abs(place_ - ring) < width
            if near.any() and np.median(along[near]) < _FALLEN * usual * ring:
                break
            last = float(ring)
        return last + _STEP / 2
