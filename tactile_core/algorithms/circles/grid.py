"""Contact circles of many balls in one frame, refined from approximate centres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial
from tactile_core.algorithms.arrays.types import Bool, Float32, Float64
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.press import PressImage, disc
from tactile_core.algorithms.circles.press_fit import PRESS_FIT
from tactile_core.algorithms.light.photometric import place, relative_change
from tactile_core.algorithms.slopes.sampling import Sampling


@dataclass(frozen=True, eq=False)
class GridLight:
    """Light fitted to the balls of a grid; it locates other balls in the same frame.

    Attributes
    ----------
    steps : sequence of (PolynomialFit, float)
        Polynomials from colour, and perhaps position, to ``normal_xy``, from coarse to fine, each
        with the distance in ball radii within which it is used.
    residual : float
        Median residual of a ball.
    contact : float
        Contact radius in ball radii.
    with_place : bool
        Whether the polynomials depend on the position.
    """

    steps: Sequence[tuple[PolynomialFit, float]]
    residual: float
    contact: float
    with_place: bool

    def locate(self, image: PressImage, centres_px: Float64, ball_radius_px: float) -> list[Circle]:
        """Refine the circles of balls that this light was not fitted to."""
        balls = _Balls.from_image(image, centres_px, ball_radius_px, self.with_place)
        residuals = np.full(len(balls.centres), np.inf)
        for light, reach in self.steps:
            residuals = balls.move(light, reach)
        return self.circles(balls.centres, residuals, ball_radius_px)

    def circles(
        self, centres_px: Float64, residuals: Float64, ball_radius_px: float
    ) -> list[Circle]:
        """Return the circles of balls that this light has moved, used or with a reason why not."""
        found = []
        for (x, y), residual in zip(centres_px, residuals, strict=True):
            reason = ""
            if not np.isfinite(residual):
                reason = "it is outside the image"
            elif residual > 2.5 * self.residual:  # half of the balls are below 1
                reason = "its colours are not those of the other balls"
            elif self.contact < PRESS_FIT.smallest_contact:
                reason = "the contact is too small to calibrate on; press deeper"
            found.append(Circle((float(x), float(y)), self.contact * ball_radius_px, reason))
        return found


def refine_grid(
    image: PressImage, centres_px: Float64, ball_radius_px: float
) -> tuple[list[Circle], GridLight]:
    """Refine the circles of many balls in one frame.

    A polynomial of colour and position is fitted to ``normal_xy``, (p − c) / R, of all balls. Then
    each centre moves to where the fitted normal is vertical. Both steps alternate. Errors of the
    given centres differ from ball to ball and average out in the polynomial.

    Parameters
    ----------
    image : PressImage
    centres_px : (N, 2) float
        x and y, accurate to a fifth of the radius.
    ball_radius_px : float
        Radius of the balls themselves.

    Returns
    -------
    circles : list of Circle, in the order of the centres
    light : GridLight
        Locates other balls in the same frame.
    """
    # [count] With fewer balls, terms of the position would fit the errors of the given centres,
    # and even terms their common shift. So the normals are then odd in the change, without the
    # position.
    many = len(centres_px) >= 12
    balls = _Balls.from_image(image, centres_px, ball_radius_px, many)
    contact = 1.0
    steps = []
    residuals = np.full(len(balls.centres), np.inf)
    for planned in (0.5, 0.85):  # [ball radii] first on what every contact covers
        reach = min(planned, max(contact, PRESS_FIT.smallest_contact))
        light = balls.fit_normals(reach, many)
        residuals = balls.move(light, reach)
        contact = balls.contact(light, reach)
        steps.append((light, reach))
    seen = residuals[np.isfinite(residuals)]
    common = GridLight(tuple(steps), float(np.median(seen)) if len(seen) else 0.0, contact, many)
    return common.circles(balls.centres, residuals, ball_radius_px), common


class _Balls:
    """Balls of a frame while their centres are refined."""

    def __init__(self, features: Float32, surface: Bool, centres: Float64, radius: float) -> None:
        self._features, self._surface, self._radius = features, surface, radius
        self.centres = centres

    @classmethod
    def from_image(
        cls, image: PressImage, centres_px: Float64, radius_px: float, with_place: bool
    ) -> Self:
        """Prepare the features of a frame: its relative change, and perhaps the position."""
        blur_px = max(1.2, 0.1 * radius_px)
        smoothing = Sampling.at_every_pixel(image.pixels.shape, image.marker_mask, blur_px)
        features = relative_change(
            smoothing.smooth(image.pixels, image.marker_mask),
            smoothing.smooth_image(image.reference, image.marker_mask),
            full_scale=image.full_scale,
        )
        if with_place:
            features = np.concatenate([features, place(features.shape[:2])], axis=2)
        surface = (
            np.ones(features.shape[:2], bool) if image.marker_mask is None else ~image.marker_mask
        )
        return cls(features, surface, np.array(centres_px, float), radius_px)

    def _disc(self, centre: Float64, reach: float) -> tuple[Float32, Float64]:
        """Features of the surface within ``reach`` of a centre, and (N, 2) offsets in radii."""
        x, y = disc(self._surface, centre, reach * self._radius)
        return self._features[y, x], (np.stack([x, y], 1) - centre) / self._radius

    def fit_normals(self, reach: float, many: bool) -> PolynomialFit:
        """Fit ``normal_xy`` as a polynomial of colour and, for many balls, of the position."""
        discs = [self._disc(centre, reach) for centre in self.centres]
        features = np.concatenate([f for f, _ in discs])
        offsets = np.concatenate([o for _, o in discs])
        pick = np.random.default_rng(0).permutation(len(features))[:12_000]
        seen, normal_xy = features[pick], offsets[pick].astype(np.float32)
        if many:
            return fit_polynomial(seen, normal_xy, order=2, ridge=1e-3)
        # On the other side of its centre a ball changes the colour oppositely.
        return fit_polynomial(
            np.concatenate([seen, -seen]),
            np.concatenate([normal_xy, -normal_xy]),
            order=1,
            ridge=1e-3,
        )

    def move(self, light: PolynomialFit, reach: float) -> Float64:
        """Move each centre to where its normal is vertical.

        Returns
        -------
        (N,) float64
            Residual of each ball; infinite where it is not visible.
        """
        residuals = np.full(len(self.centres), np.inf)
        for i, centre in enumerate(self.centres):
            features, offsets = self._disc(centre, reach)
            if len(features) < 30:  # too few pixels for a centre
                continue
            normal_xy = light(features).astype(np.float64)
            spread = offsets - offsets.mean(0)
            scale = float((spread * normal_xy).sum() / (spread * spread).sum())
            shift = offsets.mean(0) - normal_xy.mean(0)
            residuals[i] = np.sqrt(((normal_xy - scale * (offsets - shift)) ** 2).sum(1).mean())
            self.centres[i] = centre + self._radius * np.clip(shift, -0.25, 0.25)
        return residuals

    def contact(self, light: PolynomialFit, reach: float) -> float:
        """Contact radius, where the slope falls behind that within ``reach``, in ball radii."""
        discs = [self._disc(centre, 1.0) for centre in self.centres]
        offsets = np.concatenate([o for _, o in discs])
        normal_xy = np.concatenate([light(f) for f, _ in discs])
        place_ = np.hypot(offsets[:, 0], offsets[:, 1])
        along = (normal_xy * offsets).sum(1) / np.maximum(place_, 1e-6)
        inside = place_ < reach
        slope = float((along[inside] @ place_[inside]) / (place_[inside] @ place_[inside]))
        rings = np.arange(PRESS_FIT.smallest_contact, 1.0, 0.05)
        width = max(0.025, 0.75 / self._radius)  # half a ring, but at least three quarters of a px
        for ring in rings:
            near = np.abs(place_ - ring) < width
            # beyond the contact the slope is below this share of that of the ball
            if near.any() and np.median(along[near]) < 0.88 * slope * ring:
                return float(ring) - 0.025
        return float(rings[-1]) + 0.025
