"""Contact circles of many presses, found together with a common model of the light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.border import NO_BORDER, Border, find_border
from tactile_core.algorithms.circles.centre import CENTRE, FittedCentre, fit_centre
from tactile_core.algorithms.circles.light import LIGHT, Light, Samples, fit, orders_for, samples_on
from tactile_core.algorithms.circles.press import disc
from tactile_core.algorithms.circles.shape import BALL
from tactile_core.algorithms.circles.start import Sighting, Start, darkens


class FinderParameters(NamedTuple):
    """Parameters of the joint fit of circles and light.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.

    Attributes
    ----------
    smallest_contact : float, ball radii
        Smaller contacts are excluded. The light is always fitted at least this far.
        Source: chosen by hand; no script derives it.
    largest_residual : float, median residuals
        Presses with a larger residual are excluded.
        Source: chosen by hand; no script derives it.
    farthest_move : float, ball radii
        Presses whose centre moves further from its first estimate are excluded.
        Source: chosen by hand; no script derives it.
    first_reach, second_reach : float, ball radii
        Distance from the centre within which the light is fitted, before contacts are known.
        Source: chosen by hand; no script derives it.
    contact_share : float, contact radii
        The same once the contact radius is known.
        Source: chosen by hand; no script derives it.
    largest_reach : float, ball radii
        Upper bound of that distance.
        Source: chosen by hand; no script derives it.
    held_out_reaches : tuple of float, ball radii
        Distances within which a held-out press is located, one after the other.
        Source: chosen by hand; no script derives it.
    contact_rounds : int, count
        How often contacts are found, outliers excluded and the light fitted again.
        Source: chosen by hand; no script derives it.
    alternations : int, count
        Most rounds of fitting light and centres alternately.
        Source: chosen by hand; no script derives it.
    settled_px : float, working px
        The alternation ends when no centre moves further.
        Source: chosen by hand; no script derives it.
    largest_shift : float, ball radii
        Upper bound of the move of a centre in one round.
        Source: chosen by hand; no script derives it.
    newton_rounds : int, count
        Most Gauss–Newton steps of a centre per round; the next round continues.
        Source: chosen by hand; no script derives it.
    shape_margin : float, ball radii
        Distance from the contact within which the centre is fitted once the contact is known.
        Source: chosen by hand; no script derives it.
    most_pixels : int, count
        Pixels that are drawn at random for that.
        Source: chosen by hand; no script derives it.
    spread_rounds : int, count
        How often the spread of a light with given circles is estimated.
        Source: chosen by hand; no script derives it.
    largest_centre_std : float, ball radii
        Presses whose centre is less certain are excluded.
        Source: chosen by hand; no script derives it.
    least_visible : float, share
        With less of the contact inside the image, that is the reason for an uncertain centre.
        Source: chosen by hand; no script derives it.
    std_factor : float, ratio
        Standard deviation of a centre over that by the disagreement of its sectors.
        Source: virtual units (``experiments/circle_finding.py``), for a coverage of 68 %.
    model_std : float, ball radii
        Standard deviation of a coordinate by errors that all sectors share.
        Source: virtual units (``experiments/circle_finding.py``), for a coverage of 68 %.
    radius_factor : float, ratio
        Standard deviation of a contact radius over that by its residuals.
        Source: virtual units (``experiments/circle_finding.py``), for a coverage of 68 %.
    radius_model_std : float, ball radii
        Standard deviation of a contact radius by errors of the shape of the gel surface.
        Source: virtual units (``experiments/circle_finding.py``), for a coverage of 68 %.
    """

    smallest_contact: float = 0.3
    largest_residual: float = 4.0
    farthest_move: float = 0.5
    first_reach: float = 0.5
    second_reach: float = 0.65
    contact_share: float = 0.95
    largest_reach: float = 0.9
    held_out_reaches: tuple[float, ...] = (0.5, 0.6, 0.8)
    contact_rounds: int = 2
    alternations: int = 6
    settled_px: float = 0.01
    largest_shift: float = 0.25
    newton_rounds: int = 4
    shape_margin: float = 0.5
    most_pixels: int = 1200
    spread_rounds: int = 2
    largest_centre_std: float = 0.1
    least_visible: float = 0.8
    std_factor: float = 3.0
    model_std: float = 0.008
    radius_factor: float = 2.0
    radius_model_std: float = 0.018


FINDER = FinderParameters()
"""The values in use."""


@dataclass(frozen=True)
class Circle:
    """Contact circle of a ball.

    Attributes
    ----------
    centre_px : (x, y)
        0-based, integers at pixel centres.
    contact_radius_px : float
    used : bool
        Whether it is good enough to calibrate on.
    why : str
        Reason for excluding it; "" when used.
    confidence : float
        0 to 1.
    centre_std_px : float
        Standard deviation of each coordinate of the centre; NaN for a circle that was given.
    radius_std_px : float
        Standard deviation of the radius; NaN for a circle that was given.
    """

    centre_px: tuple[float, float]
    contact_radius_px: float
    used: bool = True
    why: str = ""
    confidence: float = 1.0
    centre_std_px: float = float("nan")
    radius_std_px: float = float("nan")


def find_circles(
    starts: Sequence[Start], *, progress: Callable[[float], None] | None = None
) -> list[Circle]:
    """Find the circle of each press, and exclude frames that are no clean press of the ball.

    Parameters
    ----------
    starts : sequence of Start
        Presses of one image size and one working scale, one ball each. The result depends on these
        presses alone, so that circles in the training set do not depend on held-out presses.
    progress : callable, optional
        Called with the share of the work that is done.

    Returns
    -------
    list of Circle, in the order of the presses
    """
    report = progress or (lambda share: None)
    fades = darkens(starts)
    reasons = [start.seen(darkens=fades).why for start in starts]
    kept = [i for i, reason in enumerate(reasons) if not reason]
    fits = {i: _Fit.of(starts[i], darkens=fades) for i in kept}
    if kept:
        orders = orders_for(len(kept))
        low_orders = min(2, orders[0]), min(1, orders[1])
        _alternate(fits, low_orders, fades=fades)
        for fitted in fits.values():
            fitted.reach = FINDER.second_reach * fitted.ball
        light = _alternate(fits, orders, fades=fades)
        report(0.4)
        for round_ in range(FINDER.contact_rounds):
            for fitted in fits.values():
                fitted.find_contact(light)
            for i, reason in _outliers(fits).items():
                reasons[i] = reason
                del fits[i]
            if not fits:
                break
            for fitted in fits.values():
                fitted.reach = _trusted(fitted.border.radius, fitted.ball)
            light = _alternate(fits, orders_for(len(fits)), fades=fades)
            report(0.4 + 0.3 * (round_ + 1))
        for fitted in fits.values():
            fitted.find_contact(light)
    report(1.0)
    return [
        fits[i].circle() if i in fits else _excluded(start.seen(darkens=fades), reason)
        for i, (start, reason) in enumerate(zip(starts, reasons, strict=True))
    ]


def fit_light(starts: Sequence[Start], circles: Sequence[Circle]) -> Light:
    """Fit the light to presses whose circles are known."""
    fades = darkens(starts)
    fits = {}
    for i, (start, circle) in enumerate(zip(starts, circles, strict=True)):
        fitted = _Fit.of(start, darkens=fades)
        change = fitted.sighting.change
        fitted.centre = change.to_working(np.asarray(circle.centre_px))
        fitted.reach = _trusted(circle.contact_radius_px * change.scale, start.ball)
        fits[i] = fitted
    orders = orders_for(len(fits))
    light = fit([f.samples() for f in fits.values()], orders, darkens=fades)
    for _ in range(FINDER.spread_rounds):
        light = _with_spread(light, [f.refit(light) for f in fits.values()])
    return light


def locate(start: Start, light: Light) -> Circle:
    """Find the circle of one press with a light that was fitted to other presses."""
    fitted = _Fit.of(start, darkens=light.darkens)
    for reach in FINDER.held_out_reaches:
        fitted.reach = reach * start.ball
        fitted.move(light)
    fitted.find_contact(light)
    fitted.reach = _trusted(fitted.border.radius, start.ball)
    fitted.move(light)
    fitted.find_contact(light)
    return fitted.circle()


def _trusted(contact: float, ball: float) -> float:
    """Distance from the centre within which the light is fitted to a contact."""
    bounds = FINDER.smallest_contact * ball, FINDER.largest_reach * ball
    return float(np.clip(FINDER.contact_share * contact, *bounds))


@dataclass
class _Fit:
    """State of a press during the fit, in working pixels."""

    sighting: Sighting
    ball: float
    centre: Float64
    reach: float
    fitted: FittedCentre | None = None
    border: Border = NO_BORDER

    @classmethod
    def of(cls, start: Start, *, darkens: bool) -> Self:
        sighting = start.seen(darkens=darkens)
        return cls(sighting, start.ball, sighting.centre, FINDER.first_reach * start.ball)

    @property
    def residual(self) -> float:
        """Median residual of the last fit."""
        return np.inf if self.fitted is None else self.fitted.residual

    def samples(self) -> Samples:
        """Pixels to fit the light and the centre to."""
        most = LIGHT.most_pixels
        return samples_on(self.sighting.change, self.centre, self.reach, self.ball, most)

    def refit(self, light: Light) -> FittedCentre:
        """Fit the centre to a light, without moving."""
        change, shape = self.sighting.change, self.border.shape
        samples = self.samples()
        if shape is not BALL:
            # Around a contact the slope changes most, which determines the centre best.
            reach, most = self.border.radius + FINDER.shape_margin * self.ball, FINDER.most_pixels
            samples = samples_on(change, self.centre, reach, self.ball, most)
        return fit_centre(
            samples,
            light,
            self.centre,
            self.ball,
            shape,
            change.grain_px2,
            FINDER.newton_rounds,
        )

    def move(self, light: Light) -> float:
        """Move to the fitted centre, and return the distance before it is bounded."""
        self.fitted = self.refit(light)
        step = self.fitted.at - self.centre
        length = float(np.hypot(*step))
        shift = FINDER.largest_shift * self.ball
        self.centre = self.centre + step * min(1.0, shift / max(length, 1e-9))
        return length

    def find_contact(self, light: Light) -> None:
        """Update the border of the contact."""
        assert self.fitted is not None
        change, deviation = self.sighting.change, self.fitted.deviation
        self.border = find_border(change, light, deviation, self.centre, self.ball)

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
        noise = FINDER.std_factor**2 * float(np.trace(self.fitted.covariance)) / 2
        return float(np.sqrt(noise + (FINDER.model_std * self.ball) ** 2))

    @property
    def radius_std(self) -> float:
        """Standard deviation of the contact radius."""
        noise, model = FINDER.radius_factor * self.border.std, FINDER.radius_model_std * self.ball
        return float(np.hypot(noise, model))

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


def _alternate(fits: dict[int, _Fit], orders: tuple[int, int], *, fades: bool) -> Light:
    """Fit the light to the centres and the centres to the light, until they converge."""
    spread = None
    for _ in range(FINDER.alternations):
        light = fit([f.samples() for f in fits.values()], orders, darkens=fades)
        if spread is not None:
            light = replace(light, spread=spread[0], residual=spread[1])
        moved = max([fitted.move(light) for fitted in fits.values()])
        light = _with_spread(light, [f.fitted for f in fits.values() if f.fitted is not None])
        spread = light.spread, light.residual
        if moved < FINDER.settled_px:
            break
    return light


def _with_spread(light: Light, fitted: Sequence[FittedCentre]) -> Light:
    """Update how much presses deviate from the light, by expectation maximisation."""
    seen = [f for f in fitted if np.isfinite(f.residual)]
    if not seen:
        return light
    square = np.mean([f.square for f in seen], axis=0)
    residual = float(np.median([f.residual for f in seen]))
    return replace(light, spread=np.sqrt(square), residual=residual)


def _outliers(fits: dict[int, _Fit]) -> dict[int, str]:
    """Indices of presses that do not fit the common light, each with the reason."""
    median = float(np.median([f.residual for f in fits.values()]))
    typical = max(median, CENTRE.least_residual)
    found = {}
    for i, fitted in fits.items():
        ball, start = fitted.ball, fitted.sighting.centre
        if fitted.residual > FINDER.largest_residual * typical:
            found[i] = "not one ball: its colours are not those of the other presses"
        elif np.hypot(*(fitted.centre - start)) > FINDER.farthest_move * ball:
            found[i] = "not one ball: the centres by its colours and by its symmetry differ"
        elif fitted.border.radius < FINDER.smallest_contact * ball:
            found[i] = "the contact is too small to calibrate on; press deeper"
        elif fitted.centre_std > FINDER.largest_centre_std * ball:
            found[i] = "its centre is uncertain"
            if fitted.visible_share < FINDER.least_visible:
                found[i] += ", because the image border cuts the contact; press further inside"
    return found


def _excluded(sighting: Sighting, reason: str) -> Circle:
    x, y = sighting.change.to_image(sighting.centre)
    return Circle((float(x), float(y)), 0.0, False, reason, 0.0)
