"""Finds the circles of all presses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.centre import CENTRE, FittedCentre, fit_centres
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.light import LightModel, fit, orders_for
from tactile_core.algorithms.circles.press_fit import PRESS_FIT, PressFit, choose_fit_reach
from tactile_core.algorithms.circles.start import Sighting, Start, darkens


class MIXING:
    """Parameters of Anderson's mixing.

    Nothing sets them from outside: they have no unit of a sensor.
    """

    # [count] Earlier steps that are compared with the last one. Source: virtual units (ADR 92).
    memory = 3
    # [ratio] Penalty on their weights, over the mean square of their differences. It keeps the
    # mixed step bounded where the differences are noise. Source: virtual units (ADR 92), among
    # 1e-3 and 1e-2.
    ridge = 1e-3


class Mixing:
    """Steps of a fixed-point iteration, mixed as by Anderson [1]_.

    Where a quantity follows another that is fitted to it, each step of an alternation is too short
    by a factor that differs between the directions. How much shorter the steps have become shows
    the factor: the mixed step leads to where they would vanish.

    References
    ----------
    .. [1] D. G. Anderson, "Iterative procedures for nonlinear integral equations", Journal of the
       ACM 12(4), 1965; H. F. Walker and P. Ni, "Anderson acceleration for fixed-point iterations",
       SIAM Journal on Numerical Analysis 49(4), 2011.
    """

    def __init__(self) -> None:
        self._places: list[Float64] = []
        self._steps: list[Float64] = []

    def mix_step(self, place: Float64, step: Float64) -> Float64:
        """Return what to add to a place, of which one iteration would add a step; any one shape."""
        self._places = [*self._places, place.ravel()][-MIXING.memory - 1 :]
        self._steps = [*self._steps, step.ravel()][-MIXING.memory - 1 :]
        if len(self._steps) == 1:
            return step
        by_place, by_step = np.diff(self._places, axis=0), np.diff(self._steps, axis=0)
        normal = by_step @ by_step.T
        count = len(normal)
        normal += (MIXING.ridge * np.trace(normal) / count + _TINY) * np.eye(count)
        weights = np.linalg.solve(normal, by_step @ self._steps[-1])
        mixed: Float64 = self._steps[-1] - weights @ (by_place + by_step)
        return mixed.reshape(step.shape)


_TINY = 1e-30  # Keeps the equations regular where nothing moves


class FINDER:
    """Parameters of the joint fit of circles and light.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.
    """

    largest_residual = 4.0  # [median residuals] Presses with a larger residual are excluded
    # [ball radii] Presses whose centre moves further from its first estimate are excluded.
    farthest_move = 0.5
    # [ball radii] Distance from the centre within which the light is fitted for the second time.
    second_reach = 0.65
    # [ball radii] Distances within which a held-out press is located, one after the other.
    held_out_reaches: tuple[float, ...] = (0.5, 0.6, 0.8)
    # [count] Most rounds of finding its contact and its centre, each with the other. Source:
    # virtual units (ADR 92), among 1 to 8.
    held_out_rounds = 4
    # [working px] They end when the centre moves less. Source: a tenth of the error of a centre
    # on virtual units (ADR 92).
    held_out_settled_px = 0.02
    # [count] How often contacts are found, outliers excluded and the light fitted again.
    contact_rounds = 2
    # [count] Most rounds of fitting light and centres alternately. Source: virtual units (ADR
    # 92), among 4 to 40.
    alternations = 8
    # [count] Most presses whose circles are fitted together with the light from the start on.
    # More are located with that light first. Source: ADR 89.
    most_together = 60
    last_rounds = 2  # [count] Rounds of fitting light and centres of all presses then
    settled_px = 0.01  # [working px] The alternation ends when no centre moves further
    spread_rounds = 2  # [count] How often the spread of a light with given circles is estimated
    largest_centre_std = 0.1  # [ball radii] Presses whose centre is less certain are excluded
    # [share] With less of the contact inside the image, that is the reason for an uncertain
    # centre.
    least_visible = 0.8


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
    reasons = [start.choose_sighting(darkens=fades).why for start in starts]
    kept = [i for i, reason in enumerate(reasons) if not reason]
    fits = {i: PressFit.from_start(starts[i], darkens=fades) for i in kept}
    # evenly spread over the recording, so that a change of the light during it is seen
    count = min(len(kept), FINDER.most_together)
    first = {kept[i] for i in np.linspace(0, len(kept) - 1, count).round().astype(int)}
    together = {i: fits[i] for i in kept if i in first}
    light = _fit_together(together, reasons, fades=fades, report=report)
    if light is None or count == len(kept):
        fits = together
    else:
        fits = {i: fits[i] for i in kept if i in together or i not in first}
        for i, fitted in fits.items():
            if i not in first:
                _approach(fitted, light)
        for i, reason in _outliers(fits).items():
            reasons[i] = reason
            del fits[i]
        light = _alternate(fits, orders_for(len(fits)), fades=fades, rounds=FINDER.last_rounds)
    for fitted in fits.values():
        assert light is not None
        fitted.find_contact(light, last=True)
    report(1.0)
    return [
        fits[i].circle()
        if i in fits
        else _exclude_sighting(start.choose_sighting(darkens=fades), reason)
        for i, (start, reason) in enumerate(zip(starts, reasons, strict=True))
    ]


def _fit_together(
    fits: dict[int, PressFit],
    reasons: list[str],
    *,
    fades: bool,
    report: Callable[[float], None],
) -> LightModel | None:
    """Fit light and circles from the starts on; outliers leave ``fits``, with their reason."""
    if not fits:
        return None
    orders = orders_for(len(fits))
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
            return None
        for fitted in fits.values():
            fitted.reach = choose_fit_reach(fitted.border.radius, fitted.ball)
        light = _alternate(fits, orders_for(len(fits)), fades=fades)
        report(0.4 + 0.2 * (round_ + 1))
    return light


def fit_light(starts: Sequence[Start], circles: Sequence[Circle]) -> LightModel:
    """Fit the light to presses whose circles are known."""
    fades = darkens(starts)
    fits = {}
    for i, (start, circle) in enumerate(zip(starts, circles, strict=True)):
        fitted = PressFit.from_start(start, darkens=fades)
        change = fitted.sighting.change
        fitted.centre = change.to_working(np.asarray(circle.centre_px))
        fitted.reach = choose_fit_reach(circle.contact_radius_px * change.scale, start.ball)
        fits[i] = fitted
    orders = orders_for(len(fits))
    light = fit([f.samples() for f in fits.values()], orders, darkens=fades)
    for _ in range(FINDER.spread_rounds):
        light = _with_spread(light, fit_centres([f.pixels() for f in fits.values()], light))
    return light


def locate(start: Start, light: LightModel) -> Circle:
    """Find the circle of one press with a light that was fitted to other presses."""
    fitted = PressFit.from_start(start, darkens=light.darkens)
    _approach(fitted, light)
    fitted.find_contact(light, last=True)
    return fitted.circle()


def _approach(fitted: PressFit, light: LightModel) -> None:
    """Find centre and contact of one press from its start on, with the light of other presses."""
    for reach in FINDER.held_out_reaches:
        fitted.reach = reach * fitted.ball
        fitted.move(_step(fitted, light))
    for _ in range(FINDER.held_out_rounds):
        fitted.find_contact(light)
        fitted.reach = choose_fit_reach(fitted.border.radius, fitted.ball)
        step = _step(fitted, light)
        fitted.move(step)
        if np.hypot(*step) < FINDER.held_out_settled_px:
            break


def _step(fitted: PressFit, light: LightModel) -> Float64:
    """Step of the centre of one press with the light of other presses."""
    return fitted.step(*fit_centres([fitted.pixels()], light))


def _alternate(
    fits: dict[int, PressFit],
    orders: tuple[int, int],
    *,
    fades: bool,
    rounds: int = 0,
) -> LightModel:
    """Fit the light to the centres and the centres to the light, until they converge."""
    before: LightModel | None = None
    mixing = Mixing()
    for _ in range(rounds or FINDER.alternations):
        light = fit([f.samples() for f in fits.values()], orders, darkens=fades, before=before)
        if before is not None:
            light = replace(light, spread=before.spread, residual=before.residual)
        centres = np.array([fitted.centre for fitted in fits.values()])
        found = fit_centres([fitted.pixels() for fitted in fits.values()], light)
        steps = np.array([f.step(new) for f, new in zip(fits.values(), found, strict=True)])
        for fitted, step in zip(fits.values(), mixing.mix_step(centres, steps), strict=True):
            fitted.move(step)
        light = _with_spread(light, found)
        before = light
        if np.hypot(*steps.T).max() < FINDER.settled_px:
            break
    return light


def _with_spread(light: LightModel, fitted: Sequence[FittedCentre]) -> LightModel:
    """Update how much presses deviate from the light, by expectation maximisation."""
    seen = [f for f in fitted if np.isfinite(f.residual)]
    if not seen:
        return light
    square = np.mean([f.square for f in seen], axis=0)
    residual = float(np.median([f.residual for f in seen]))
    return replace(light, spread=np.sqrt(square), residual=residual)


def _outliers(fits: dict[int, PressFit]) -> dict[int, str]:
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
        elif fitted.border.radius < PRESS_FIT.smallest_contact * ball:
            found[i] = "the contact is too small to calibrate on; press deeper"
        elif fitted.centre_std > FINDER.largest_centre_std * ball:
            found[i] = "its centre is uncertain"
            if fitted.visible_share < FINDER.least_visible:
                found[i] += ", because the image border cuts the contact; press further inside"
    return found


def _exclude_sighting(sighting: Sighting, reason: str) -> Circle:
    x, y = sighting.change.to_image(sighting.centre)
    return Circle((float(x), float(y)), 0.0, False, reason, 0.0)
