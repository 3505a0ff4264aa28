"""Fit of a single press: its centre, the contact, and how certain both are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.border import NO_BORDER, Border, find_border
from tactile_core.algorithms.circles.centre import BallPixels, FittedCentre
from tactile_core.algorithms.circles.circle import BALL, Circle
from tactile_core.algorithms.circles.light import LIGHT, LightModel, Samples, samples_on
from tactile_core.algorithms.circles.press import disc
from tactile_core.algorithms.circles.start import Sighting, Start


class PRESS_FIT:
    """Parameters of the fit of single presses.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.
    """

    # [ball radii] Smaller contacts are excluded. The light is always fitted at least this far.
    smallest_contact = 0.3
    # [ball radii] Distance from the centre within which the light is fitted, before contacts are
    # known.
    first_reach = 0.5
    contact_share = 0.95  # [contact radii] The same once the contact radius is known
    largest_reach = 0.9  # [ball radii] Upper bound of that distance
    largest_shift = 0.25  # [ball radii] Upper bound of the move of a centre in one round
    # [working px] The pixels of a fit are drawn again when its centre has moved this far.
    redrawn_px = 1.0
    # [ball radii] Distance from the contact within which the centre is fitted once the contact is
    # known. The slope changes most there; farther out there are cast shadows. Source: virtual
    # units (``experiments/circle_finding.py``).
    shape_margin = 0.15
    most_pixels = 800  # [count] Pixels that are drawn at random for that
    # [ratio] Standard deviation of a centre over that by the disagreement of its sectors. Source:
    # virtual units (``experiments/circle_finding.py``), for a coverage of 68 %.
    std_factor = 2.4
    # [ball radii] Standard deviation of a coordinate by errors that all sectors share. Source:
    # virtual units (``experiments/circle_finding.py``), for a coverage of 68 %.
    model_std = 0.0009
    # [ratio] Standard deviation of a contact radius over that by the disagreement of its sectors.
    # Source: virtual units (``experiments/circle_finding.py``), for a coverage of 68 %.
    radius_factor = 4.1
    # [ratio] Standard deviation of a contact radius over the width of its border, by errors that
    # all sectors share. Source: virtual units (``experiments/circle_finding.py``), for a coverage
    # of 68 %.
    radius_width_share = 0.17


class _Draw(NamedTuple):
    """Pixels that were drawn around a centre, with the normals of a ball at another."""

    centre: Float64
    reach: float
    ball_at: Float64
    samples: Samples


@dataclass
class PressFit:
    """State of a press during the fit, in working pixels."""

    sighting: Sighting
    ball: float
    centre: Float64
    reach: float
    fitted: FittedCentre | None = None
    border: Border = NO_BORDER
    _draws: dict[str, _Draw] = field(default_factory=dict)

    @classmethod
    def from_start(cls, start: Start, *, darkens: bool) -> Self:
        """Start from the press alone."""
        sighting = start.choose_sighting(darkens=darkens)
        return cls(sighting, start.ball, sighting.centre, PRESS_FIT.first_reach * start.ball)

    @property
    def residual(self) -> float:
        """Median residual of the last fit."""
        return np.inf if self.fitted is None else self.fitted.residual

    def samples(self) -> Samples:
        """Pixels to fit the light and the centre to."""
        return self._draw_samples("light", self.reach, LIGHT.most_pixels)

    def pixels(self) -> BallPixels:
        """Pixels to fit the centre to."""
        shape, samples = self.border.shape, None
        if shape is not BALL:
            # Around a contact the slope changes most, which determines the centre best.
            reach = self.border.radius + PRESS_FIT.shape_margin * self.ball
            samples = self._draw_samples("centre", reach, PRESS_FIT.most_pixels)
        grain_px2 = self.sighting.change.grain_px2
        return BallPixels(samples or self.samples(), self.centre, self.ball, shape, grain_px2)

    def _draw_samples(self, use: str, reach: float, most: int) -> Samples:
        """Draw pixels, or return those that were drawn for nearly this centre."""
        drawn = self._draws.get(use)
        if (
            drawn is None
            or drawn.reach != reach
            or max(abs(drawn.centre - self.centre)) >= PRESS_FIT.redrawn_px
        ):
            samples = samples_on(self.sighting.change, self.centre, reach, self.ball, most)
            drawn = _Draw(self.centre, reach, self.centre, samples)
        elif drawn.ball_at is not self.centre:
            samples = drawn.samples.about(self.centre, self.ball)
            drawn = drawn._replace(ball_at=self.centre, samples=samples)
        self._draws[use] = drawn
        return drawn.samples

    def step(self, fitted: FittedCentre) -> Float64:
        """Keep the fit of the centre, and return its step (2,)."""
        self.fitted = fitted
        return fitted.at - self.centre

    def move(self, step: Float64) -> None:
        """Move the centre by a step, which is bounded."""
        length = max(float(np.hypot(*step)), 1e-9)
        self.centre = self.centre + step * min(1.0, PRESS_FIT.largest_shift * self.ball / length)

    def find_contact(self, light: LightModel, *, last: bool = False) -> None:
        """Update the border of the contact; how certain it is only the last time."""
        assert self.fitted is not None
        change, deviation = self.sighting.change, self.fitted.deviation
        self.border = find_border(change, light, deviation, self.centre, self.ball, with_std=last)

    @property
    def visible_share(self) -> float:
        """Share of the contact that is inside the image."""
        h, w = self.sighting.change.shape
        columns, _ = disc(np.ones((h, w)), self.centre, self.border.radius)
        return len(columns) / max(np.pi * self.border.radius**2, 1.0)

    @property
    def centre_std(self) -> float:
        """Standard deviation of a coordinate of the centre."""
        if self.fitted is None:
            return np.inf
        noise = PRESS_FIT.std_factor**2 * float(np.trace(self.fitted.covariance)) / 2
        return float(np.sqrt(noise + (PRESS_FIT.model_std * self.ball) ** 2))

    @property
    def radius_std(self) -> float:
        """Standard deviation of the contact radius."""
        return float(
            np.hypot(
                PRESS_FIT.radius_factor * self.border.disagreement,
                PRESS_FIT.radius_width_share * self.border.width,
            )
        )

    def circle(self) -> Circle:
        """Return the circle in image coordinates."""
        scale = self.sighting.change.scale
        x, y = self.sighting.change.to_image(self.centre)
        return Circle(
            (float(x), float(y)),
            self.border.radius / scale,
            confidence=float(np.clip(self.sighting.oddness, 0, 1)),
            centre_std_px=self.centre_std / scale,
            radius_std_px=self.radius_std / scale,
        )


def choose_fit_reach(contact: float, ball: float) -> float:
    """Distance from the centre within which the light is fitted to a contact."""
    bounds = PRESS_FIT.smallest_contact * ball, PRESS_FIT.largest_reach * ball
    return float(np.clip(PRESS_FIT.contact_share * contact, *bounds))
