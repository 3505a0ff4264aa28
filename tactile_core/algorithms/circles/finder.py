"""Circles of many presses, found together with the light that explains them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.border import contact_radius
from tactile_core.algorithms.circles.light import (
    Light,
    fit,
    misfits,
    orders_for,
    samples_on,
)
from tactile_core.algorithms.circles.start import Start

SMALLEST_CONTACT = 0.3
MOST_MISFIT = 2.5
FARTHEST_MOVE = 0.5
_TRUSTED = 0.9


@dataclass(frozen=True)
class Circle:
    """Where a ball touches.

    Attributes
    ----------
    centre_px : (x, y)
        0-based, integers at pixel centres.
    contact_radius_px : float
    used : bool
        Good enough to calibrate on.
    why : str
        Why not; "" when used.
    confidence : float
        0..1.
    """

    centre_px: tuple[float, float]
    contact_radius_px: float
    used: bool = True
    why: str = ""
    confidence: float = 1.0


def find_circles(
    starts: Sequence[Start], *, progress: Callable[[float], None] | None = None
) -> list[Circle]:
    """Find the circle of each press, and leave out what is no clean press of the ball.

    Parameters
    ----------
    starts : sequence of Start
        One ball each, of one size and one image size. Nothing else is known of the presses, so that
        circles of some of them owe nothing to the others.
    progress : callable, optional
        Is told the share that is done.

    Returns
    -------
    list of Circle, in the order of the presses
    """
    tell = progress or (lambda share: None)
    whys = [start.why for start in starts]
    kept = [i for i, why in enumerate(whys) if not why]
    fits = {i: _Fit(starts[i], starts[i].centre, 0.5 * starts[i].ball) for i in kept}
    if kept:
        orders = orders_for(len(kept))
        gentle = min(2, orders[0]), min(1, orders[1])
        _alternate(fits, gentle)
        for fitted in fits.values():
            fitted.trusted = 0.65 * fitted.start.ball
        light = _alternate(fits, orders)
        tell(0.4)
        for round_ in range(2):
            for fitted in fits.values():
                fitted.find_contact(light)
            for i, why in _outliers(fits).items():
                whys[i] = why
                del fits[i]
            if not fits:
                break
            for fitted in fits.values():
                ball = fitted.start.ball
                fitted.trusted = float(np.clip(0.95 * fitted.contact, 0.3 * ball, _TRUSTED * ball))
            light = _alternate(fits, orders_for(len(fits)))
            tell(0.4 + 0.3 * (round_ + 1))
        for fitted in fits.values():
            fitted.find_contact(light)
    tell(1.0)
    return [
        fits[i].circle() if i in fits else _left_out(start, why)
        for i, (start, why) in enumerate(zip(starts, whys, strict=True))
    ]


def fit_light(starts: Sequence[Start], circles: Sequence[Circle]) -> Light:
    """Fit the light that explains presses whose circles are known."""
    samples = []
    for start, circle in zip(starts, circles, strict=True):
        change = start.change
        centre = change.to_working(np.asarray(circle.centre_px))
        trusted = min(0.95 * circle.contact_radius_px * change.scale, _TRUSTED * start.ball)
        samples.append(samples_on(change, centre, trusted, start.ball))
    first = starts[0].change
    return fit(samples, first.shape, first.scale, orders_for(len(samples)))


def locate(start: Start, light: Light) -> Circle:
    """Find the circle of one press with a light that was fitted to others."""
    fitted = _Fit(start, start.centre, 0.5 * start.ball)
    for share in (0.5, 0.6, 0.8):
        fitted.centre, _ = _refined(start, light, fitted.centre, share * start.ball)
    fitted.find_contact(light)
    return fitted.circle()


@dataclass
class _Fit:
    """A press while it is being fitted, in working pixels."""

    start: Start
    centre: Float64
    trusted: float
    contact: float = 0.0
    misfit: float = 0.0

    def find_contact(self, light: Light) -> None:
        """Find where the skin leaves the ball."""
        self.contact = contact_radius(self.start.change, light, self.centre, self.start.ball)

    def circle(self) -> Circle:
        """Return what was found."""
        x, y = self.start.change.to_image(self.centre)
        radius_px = self.contact / self.start.change.scale
        confidence = float(np.clip(self.start.oddness, 0, 1))
        return Circle((float(x), float(y)), radius_px, confidence=confidence)


def _alternate(fits: dict[int, _Fit], orders: tuple[int, int]) -> Light:
    """Fit the light to the centres and the centres to the light, until they rest."""
    first = next(iter(fits.values())).start.change
    for _ in range(6):
        samples = [
            samples_on(f.start.change, f.centre, f.trusted, f.start.ball) for f in fits.values()
        ]
        light = fit(samples, first.shape, first.scale, orders)
        moved = 0.0
        for fitted in fits.values():
            ball = fitted.start.ball
            target, fitted.misfit = _refined(fitted.start, light, fitted.centre, fitted.trusted)
            step = target - fitted.centre
            length = float(np.hypot(*step))
            fitted.centre = fitted.centre + step * min(1.0, 0.25 * ball / max(length, 1e-9))
            moved = max(moved, length)
        if moved < 0.01:
            break
    return light


def _refined(start: Start, light: Light, centre: Float64, radius: float) -> tuple[Float64, float]:
    """Centre whose ball would give the colours that are seen, and the misfit it leaves.

    Gauss–Newton on the two coordinates with soft-L1 weights; the pixels stay those of the start.
    """
    ball = start.ball
    samples = samples_on(start.change, centre, radius, ball)
    unit = max(light.residual, 0.5)
    if len(samples.xy) < 30:
        return centre, np.inf
    here = light.at(samples.xy)

    def error(at: Float64) -> Float64:
        e = (here((samples.xy - at) / ball) - samples.change) / unit
        e[samples.full & (e > 0)] = 0
        return e

    at, step = centre.copy(), 1e-3
    for _ in range(12):
        now = error(at)
        weight = 1 / np.sqrt(1 + (now * now).sum(1))
        slopes = [(error(at + d) - now) / step for d in (np.array([step, 0]), np.array([0, step]))]
        a = np.array([[np.einsum("n,nk,nk", weight, s, t) for t in slopes] for s in slopes])
        b = np.array([np.einsum("n,nk,nk", weight, s, now) for s in slopes])
        move = np.linalg.solve(a + 1e-9 * np.trace(a) * np.eye(2) + 1e-12 * np.eye(2), b)
        move *= min(1.0, 0.3 * ball / max(float(np.hypot(*move)), 1e-9))
        at = at - move
        if np.hypot(*move) < 1e-3:
            break
    left = misfits(here((samples.xy - at) / ball), samples.change, samples.full)
    return at, float(np.median(left))


def _outliers(fits: dict[int, _Fit]) -> dict[int, str]:
    """Presses that the common light does not explain, each with the reason."""
    usual = float(np.median([f.misfit for f in fits.values()]))
    found = {}
    for i, fitted in fits.items():
        ball = fitted.start.ball
        if fitted.misfit > MOST_MISFIT * usual:
            found[i] = "not one ball: its colours are not those of the other presses"
        elif np.hypot(*(fitted.centre - fitted.start.centre)) > FARTHEST_MOVE * ball:
            found[i] = "not one ball: its colours and its symmetry disagree on the centre"
        elif fitted.contact < SMALLEST_CONTACT * ball:
            found[i] = "the contact is too small to calibrate on; press deeper"
    return found


def _left_out(start: Start, why: str) -> Circle:
    x, y = start.change.to_image(start.centre)
    return Circle((float(x), float(y)), 0.0, False, why, 0.0)
