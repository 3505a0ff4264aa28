"""Contact circles of many presses, found together with a common model of the light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.border import contact_radius
from tactile_core.algorithms.circles.light import (
    Light,
    fit,
    orders_for,
    residuals,
    samples_on,
)
from tactile_core.algorithms.circles.start import Start


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
    fewest_pixels : int, count
        With fewer pixels a centre is not refined.
        Source: chosen by hand; no script derives it.
    least_residual : float, grey levels of 8 bits
        Lower bound of the residual scale of the soft-L1 weights.
        Source: chosen by hand; no script derives it.
    newton_rounds : int, count
        Most Gauss–Newton steps.
        Source: chosen by hand; no script derives it.
    newton_step : float, ball radii
        Upper bound of a Gauss–Newton step.
        Source: chosen by hand; no script derives it.
    difference_px : float, working px
        Step of the difference quotients, and step at which Gauss–Newton ends.
        Source: chosen by hand; no script derives it.
    """

    smallest_contact: float = 0.3
    largest_residual: float = 2.5
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
    fewest_pixels: int = 30
    least_residual: float = 0.5
    newton_rounds: int = 12
    newton_step: float = 0.3
    difference_px: float = 1e-3


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
    """

    centre_px: tuple[float, float]
    contact_radius_px: float
    used: bool = True
    why: str = ""
    confidence: float = 1.0


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
    reasons = [start.why for start in starts]
    kept = [i for i, reason in enumerate(reasons) if not reason]
    fits = {i: _Fit(starts[i], starts[i].centre, FINDER.first_reach * starts[i].ball) for i in kept}
    if kept:
        orders = orders_for(len(kept))
        low_orders = min(2, orders[0]), min(1, orders[1])
        _alternate(fits, low_orders)
        for fitted in fits.values():
            fitted.reach = FINDER.second_reach * fitted.start.ball
        light = _alternate(fits, orders)
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
                ball = fitted.start.ball
                bounds = FINDER.smallest_contact * ball, FINDER.largest_reach * ball
                fitted.reach = float(np.clip(FINDER.contact_share * fitted.contact, *bounds))
            light = _alternate(fits, orders_for(len(fits)))
            report(0.4 + 0.3 * (round_ + 1))
        for fitted in fits.values():
            fitted.find_contact(light)
    report(1.0)
    return [
        fits[i].circle() if i in fits else _excluded(start, reason)
        for i, (start, reason) in enumerate(zip(starts, reasons, strict=True))
    ]


def fit_light(starts: Sequence[Start], circles: Sequence[Circle]) -> Light:
    """Fit the light to presses whose circles are known."""
    samples = []
    for start, circle in zip(starts, circles, strict=True):
        change = start.change
        centre = change.to_working(np.asarray(circle.centre_px))
        contact = FINDER.contact_share * circle.contact_radius_px * change.scale
        reach = min(contact, FINDER.largest_reach * start.ball)
        samples.append(samples_on(change, centre, reach, start.ball))
    first = starts[0].change
    return fit(samples, first.shape, first.scale, orders_for(len(samples)))


def locate(start: Start, light: Light) -> Circle:
    """Find the circle of one press with a light that was fitted to other presses."""
    fitted = _Fit(start, start.centre, FINDER.first_reach * start.ball)
    for reach in FINDER.held_out_reaches:
        fitted.centre, _ = _refined(start, light, fitted.centre, reach * start.ball)
    fitted.find_contact(light)
    return fitted.circle()


@dataclass
class _Fit:
    """State of a press during the fit, in working pixels."""

    start: Start
    centre: Float64
    reach: float
    contact: float = 0.0
    residual: float = 0.0

    def find_contact(self, light: Light) -> None:
        """Update the contact radius."""
        self.contact = contact_radius(self.start.change, light, self.centre, self.start.ball)

    def circle(self) -> Circle:
        """Return the circle in image coordinates."""
        x, y = self.start.change.to_image(self.centre)
        radius_px = self.contact / self.start.change.scale
        confidence = float(np.clip(self.start.oddness, 0, 1))
        return Circle((float(x), float(y)), radius_px, confidence=confidence)


def _alternate(fits: dict[int, _Fit], orders: tuple[int, int]) -> Light:
    """Fit the light to the centres and the centres to the light, until they converge."""
    first = next(iter(fits.values())).start.change
    for _ in range(FINDER.alternations):
        samples = [
            samples_on(f.start.change, f.centre, f.reach, f.start.ball) for f in fits.values()
        ]
        light = fit(samples, first.shape, first.scale, orders)
        moved = 0.0
        for fitted in fits.values():
            ball = fitted.start.ball
            target, fitted.residual = _refined(fitted.start, light, fitted.centre, fitted.reach)
            step = target - fitted.centre
            length = float(np.hypot(*step))
            shift = FINDER.largest_shift * ball
            fitted.centre = fitted.centre + step * min(1.0, shift / max(length, 1e-9))
            moved = max(moved, length)
        if moved < FINDER.settled_px:
            break
    return light


def _refined(start: Start, light: Light, centre: Float64, radius: float) -> tuple[Float64, float]:
    """Refine the centre of a ball, and return it with the median residual.

    Gauss–Newton on the two coordinates with soft-L1 weights, on the pixels around the given centre.
    """
    ball = start.ball
    samples = samples_on(start.change, centre, radius, ball)
    unit = max(light.residual, FINDER.least_residual)
    if len(samples.xy) < FINDER.fewest_pixels:
        return centre, np.inf
    here = light.at(samples.xy)

    def error(at: Float64) -> Float64:
        e = (here((samples.xy - at) / ball) - samples.change) / unit
        e[samples.saturated & (e > 0)] = 0
        return e

    at, step = centre.copy(), FINDER.difference_px
    for _ in range(FINDER.newton_rounds):
        now = error(at)
        weight = 1 / np.sqrt(1 + (now * now).sum(1))
        slopes = [(error(at + d) - now) / step for d in (np.array([step, 0]), np.array([0, step]))]
        a = np.array([[np.einsum("n,nk,nk", weight, s, t) for t in slopes] for s in slopes])
        b = np.array([np.einsum("n,nk,nk", weight, s, now) for s in slopes])
        move = np.linalg.solve(a + 1e-9 * np.trace(a) * np.eye(2) + 1e-12 * np.eye(2), b)
        move *= min(1.0, FINDER.newton_step * ball / max(float(np.hypot(*move)), 1e-9))
        at = at - move
        if np.hypot(*move) < step:
            break
    length = residuals(here((samples.xy - at) / ball), samples.change, samples.saturated)
    return at, float(np.median(length))


def _outliers(fits: dict[int, _Fit]) -> dict[int, str]:
    """Indices of presses that do not fit the common light, each with the reason."""
    median = float(np.median([f.residual for f in fits.values()]))
    found = {}
    for i, fitted in fits.items():
        ball = fitted.start.ball
        if fitted.residual > FINDER.largest_residual * median:
            found[i] = "not one ball: its colours are not those of the other presses"
        elif np.hypot(*(fitted.centre - fitted.start.centre)) > FINDER.farthest_move * ball:
            found[i] = "not one ball: the centres by its colours and by its symmetry differ"
        elif fitted.contact < FINDER.smallest_contact * ball:
            found[i] = "the contact is too small to calibrate on; press deeper"
    return found


def _excluded(start: Start, reason: str) -> Circle:
    x, y = start.change.to_image(start.centre)
    return Circle((float(x), float(y)), 0.0, False, reason, 0.0)
