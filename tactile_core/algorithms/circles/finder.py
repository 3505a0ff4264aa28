"""Finds the circles of all presses."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.light import LightModel, fit, orders_for
from tactile_core.algorithms.circles.press_fit import PRESS_FIT, PressFit
from tactile_core.algorithms.circles.start import Sighting, Start, darkens

_ROUNDS = 14  # [count] Rounds of fitting the light to the presses, and the presses to the light
# [count] First rounds: with a light of low orders, and one contact radius for all. Otherwise
# light and contact explain each other.
_FIRST_ROUNDS = 4


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
    fades = darkens(starts)
    sightings = [start.choose_sighting(darkens=fades) for start in starts]
    reasons = [sighting.why for sighting in sightings]
    begun = [_begin(start, s) for start, s in zip(starts, sightings, strict=True)]
    fits = {i: one for i, one in enumerate(begun) if not reasons[i]}
    light: LightModel | None = None
    for number in range(_ROUNDS):
        if not fits:
            break
        first = number < _FIRST_ROUNDS
        light = _fit_light(fits.values(), low=first, fades=fades, before=light)
        for one in fits.values():
            one.move(one.fit_step(light, free=2 if first else 4))
        light = _with_spread(light, fits.values())
        if number in (7, 11):  # [count] Rounds after which outliers are excluded
            for i, reason in _outliers(fits).items():
                reasons[i] = reason
                del fits[i]
        if progress is not None:
            progress((number + 1) / _ROUNDS)
    return [
        fits[i].circle() if i in fits else _exclude_sighting(sighting, reason)
        for i, (sighting, reason) in enumerate(zip(sightings, reasons, strict=True))
    ]


def fit_light(starts: Sequence[Start], circles: Sequence[Circle]) -> LightModel:
    """Fit the light to presses whose circles are known."""
    fades = darkens(starts)
    fits = []
    for start, circle in zip(starts, circles, strict=True):
        fitted = _begin(start, start.choose_sighting(darkens=fades))
        fitted.centre = fitted.change.to_working(np.asarray(circle.centre_px))
        fitted.contact = circle.contact_radius_px * fitted.change.scale / fitted.ball
        fits.append(fitted)
    light = _fit_light(fits, low=False, fades=fades, before=None)
    for _ in range(2):  # The spread of the light follows from the presses, and they from it
        for fitted in fits:
            fitted.fit_step(light)
        light = _with_spread(light, fits)
    return light


def locate(start: Start, light: LightModel) -> Circle:
    """Find the circle of one press with a light that was fitted to other presses."""
    fitted = _begin(start, start.choose_sighting(darkens=light.darkens))
    for number in range(_ROUNDS):
        fitted.move(fitted.fit_step(light, free=2 if number < _FIRST_ROUNDS else 4))
    return fitted.circle()


def _begin(start: Start, sighting: Sighting) -> PressFit:
    return PressFit(sighting.change, start.ball, sighting.centre)


def _fit_light(
    fits: Collection[PressFit], *, low: bool, fades: bool, before: LightModel | None
) -> LightModel:
    """Fit the light to the present circles; its spread remains as it was."""
    by_slope, by_place = orders_for(len(fits))
    orders = (min(2, by_slope), min(1, by_place)) if low else (by_slope, by_place)
    light = fit([one.samples() for one in fits], orders, darkens=fades, before=before)
    if before is None or before.spread.shape != light.spread.shape:
        return light
    return replace(light, spread=before.spread, residual=before.residual)


def _with_spread(light: LightModel, fits: Collection[PressFit]) -> LightModel:
    """Update how much presses deviate from the light, by expectation maximisation."""
    seen = [one for one in fits if np.isfinite(one.residual)]
    if not seen:
        return light
    square = np.mean([one.square for one in seen], axis=0)
    residual = float(np.median([one.residual for one in seen]))
    return replace(light, spread=np.sqrt(square), residual=residual)


def _outliers(fits: dict[int, PressFit]) -> dict[int, str]:
    """Indices of presses that do not fit the common light, each with the reason."""
    median = float(np.median([one.residual for one in fits.values()]))
    typical = max(median, PRESS_FIT.least_residual)
    found = {}
    for i, one in fits.items():
        # [median residuals] Presses with a larger residual are excluded
        if one.residual > 4.0 * typical:
            found[i] = "not one ball: its colours are not those of the other presses"
        # [ball radii] Presses whose centre moves further from its first estimate are excluded.
        elif np.hypot(*(one.centre - one.start)) > 0.5 * one.ball:
            found[i] = "not one ball: the centres by its colours and by its symmetry differ"
        elif one.contact < PRESS_FIT.smallest_contact:
            found[i] = "the contact is too small to calibrate on; press deeper"
        # [ball radii] Presses whose centre is less certain are excluded
        elif one.centre_std > 0.1:
            found[i] = "its centre is uncertain"
            # [share] With less of the contact inside the image, that is the reason for an uncertain
            # centre.
            if one.visible_share < 0.8:
                found[i] += ", because the image border cuts the contact; press further inside"
    return found


def _exclude_sighting(sighting: Sighting, reason: str) -> Circle:
    x, y = sighting.change.to_image(sighting.centre)
    return Circle((float(x), float(y)), 0.0, reason)
