"""Circles of many presses, found together with the light that explains them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.circles.border import contact_radius
from tactile_core.algorithms.circles.light import (
    Light,
    fit,
    misfits,
    orders_for,
    samples_on,
)
from tactile_core.algorithms.circles.press import Change, PressImage, change_of, working_scale
from tactile_core.algorithms.circles.symmetry import odd_centre

Float = NDArray[np.float64]

FEWEST_ODD = 0.25
STRONGEST_ELSEWHERE = 0.5
"""Change far from a press, relative to the press's own; more is a second contact."""

WEAKEST_CONTACT = 4.0
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
    images: Sequence[PressImage],
    *,
    ball_radius_px: float,
    progress: Callable[[float], None] | None = None,
) -> list[Circle]:
    """Find the circle of each press, and leave out what is no clean press of the ball.

    Parameters
    ----------
    images : sequence of PressImage
        One ball each, of one image size.
    ball_radius_px : float
        Radius of the ball itself, not of its contact.
    progress : callable, optional
        Is told the share that is done.

    Returns
    -------
    list of Circle, in the order of the images
    """
    tell = progress or (lambda share: None)
    scale = working_scale(ball_radius_px)
    ball = ball_radius_px * scale
    changes = []
    for i, image in enumerate(images):
        changes.append(change_of(image, scale))
        tell(0.3 * (i + 1) / len(images))
    starts = [_start(change, ball) for change in changes]
    whys = [
        _unlike_a_press(c, start, odd, ball)
        for c, (start, odd) in zip(changes, starts, strict=True)
    ]
    kept = [i for i, why in enumerate(whys) if not why]
    fits: dict[int, _Fit] = {i: _Fit(starts[i][0], 0.5 * ball) for i in kept}
    if kept:
        orders = orders_for(len(kept))
        gentle = min(2, orders[0]), min(1, orders[1])
        _alternate(changes, fits, ball, gentle)
        for fitted in fits.values():
            fitted.trusted = 0.65 * ball
        light = _alternate(changes, fits, ball, orders)
        tell(0.6)
        for round_ in range(2):
            for i, why in _outliers(changes, fits, starts, light, ball).items():
                whys[i] = why
                del fits[i]
            if not fits:
                break
            for i, fitted in fits.items():
                fitted.contact = contact_radius(changes[i], light, fitted.centre, ball)
                fitted.trusted = float(np.clip(0.95 * fitted.contact, 0.3 * ball, _TRUSTED * ball))
            light = _alternate(changes, fits, ball, orders_for(len(fits)))
            tell(0.6 + 0.2 * (round_ + 1))
        for i, fitted in fits.items():
            fitted.contact = contact_radius(changes[i], light, fitted.centre, ball)
    tell(1.0)
    return [_circle(changes[i], fits.get(i), starts[i], whys[i], ball) for i in range(len(images))]


def fit_light(
    images: Sequence[PressImage], circles: Sequence[Circle], ball_radius_px: float
) -> Light:
    """Fit the light that explains presses whose circles are known."""
    scale = working_scale(ball_radius_px)
    ball = ball_radius_px * scale
    samples, shape = [], (1, 1)
    prepared: dict[int, Change] = {}
    for image, circle in zip(images, circles, strict=True):
        change = prepared.setdefault(id(image), change_of(image, scale))
        centre = change.to_working(np.asarray(circle.centre_px))
        trusted = min(0.95 * circle.contact_radius_px * scale, _TRUSTED * ball)
        samples.append(samples_on(change, centre, trusted, ball))
        shape = change.weight.shape[0], change.weight.shape[1]
    return fit(samples, shape, scale, orders_for(len(samples)))


def locate(image: PressImage, light: Light, ball_radius_px: float) -> Circle:
    """Find the circle of one press with a light that was fitted to others."""
    ball = ball_radius_px * light.scale
    change = change_of(image, light.scale)
    centre, _ = odd_centre(change, ball)
    for share in (0.5, 0.6, 0.8):
        centre, _ = _refined(change, light, centre, ball, share * ball)
    fitted = _Fit(centre, 0.8 * ball, contact=contact_radius(change, light, centre, ball))
    return _circle(change, fitted, (centre, 1.0), "", ball)


@dataclass
class _Fit:
    """A press while it is being fitted, in working pixels."""

    centre: Float
    trusted: float
    contact: float = 0.0
    misfit: float = 0.0


def _alternate(
    changes: Sequence[Change], fits: dict[int, _Fit], ball: float, orders: tuple[int, int]
) -> Light:
    """Fit the light to the centres and the centres to the light, until they rest."""
    first = changes[0]
    shape = first.weight.shape[0], first.weight.shape[1]
    for _ in range(6):
        light = fit(
            [samples_on(changes[i], f.centre, f.trusted, ball) for i, f in fits.items()],
            shape,
            first.scale,
            orders,
        )
        moved = 0.0
        for i, fitted in fits.items():
            target, fitted.misfit = _refined(changes[i], light, fitted.centre, ball, fitted.trusted)
            step = target - fitted.centre
            length = float(np.hypot(*step))
            fitted.centre = fitted.centre + step * min(1.0, 0.25 * ball / max(length, 1e-9))
            moved = max(moved, length)
        if moved < 0.01:
            break
    return light


def _refined(
    change: Change, light: Light, centre: Float, ball: float, radius: float
) -> tuple[Float, float]:
    """Centre whose ball would give the colours that are seen, and the misfit it leaves.

    Gauss–Newton on the two coordinates with soft-L1 weights; the pixels stay those of the start.
    """
    samples = samples_on(change, centre, radius, ball)
    unit = max(light.residual, 0.5)
    if len(samples.xy) < 30:
        return centre, np.inf

    def error(at: Float) -> Float:
        e = (light(samples.xy, (samples.xy - at) / ball) - samples.change) / unit
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
    left = misfits(light(samples.xy, (samples.xy - at) / ball), samples.change, samples.full)
    return at, float(np.median(left))


def _start(change: Change, ball: float) -> tuple[Float, float]:
    """Centre about which the change is most odd, and how odd it is."""
    found = odd_centre(change, ball)
    if found[1] >= FEWEST_ODD:
        return found
    # Lamps that stand high all dim on every slope, which is even; between the channels nothing is.
    return max(found, odd_centre(change.between_channels(), ball), key=lambda start: start[1])


def _unlike_a_press(change: Change, start: Float, odd: float, ball: float) -> str:
    """Why the change alone rules a press out; "" if it does not."""
    x, y = change.disc(start, 0.6 * ball)
    if len(x) == 0:
        return "no contact: the skin is hidden where something changed"
    strength = float(np.sqrt((change.values[y, x] ** 2).sum(1).mean())) / change.noise
    if strength < WEAKEST_CONTACT:
        return "no contact: the change is hardly above the noise"
    if odd < FEWEST_ODD:
        return "not a ball: the change is not odd about any centre"
    if _elsewhere(change, start, ball) > STRONGEST_ELSEWHERE:
        return "not one ball: something else touches, or the gel or the light has changed"
    return ""


def _elsewhere(change: Change, start: Float, ball: float) -> float:
    """Strongest change beyond 2.5 ball radii, relative to the strongest within one."""
    energy = (change.values**2).sum(2) * change.weight
    sigma = 0.35 * ball
    total = np.maximum(cv2.GaussianBlur(change.weight, (0, 0), sigma), 1e-3)
    local = cv2.GaussianBlur(energy, (0, 0), sigma) / total
    h, w = local.shape
    distance = np.hypot(np.arange(w) - start[0], np.arange(h)[:, None] - start[1])
    far = local[distance > 2.5 * ball]
    near = local[distance < ball]
    return float(np.sqrt(far.max() / near.max())) if far.size and near.size else 0.0


def _outliers(
    changes: Sequence[Change],
    fits: dict[int, _Fit],
    starts: Sequence[tuple[Float, float]],
    light: Light,
    ball: float,
) -> dict[int, str]:
    """Presses that the common light does not explain, each with the reason."""
    usual = float(np.median([f.misfit for f in fits.values()]))
    found = {}
    for i, fitted in fits.items():
        radius = contact_radius(changes[i], light, fitted.centre, ball)
        if fitted.misfit > MOST_MISFIT * usual:
            found[i] = "not one ball: its colours are not those of the other presses"
        elif np.hypot(*(fitted.centre - starts[i][0])) > FARTHEST_MOVE * ball:
            found[i] = "not one ball: its colours and its symmetry disagree on the centre"
        elif radius < SMALLEST_CONTACT * ball:
            found[i] = "the contact is too small to calibrate on; press deeper"
    return found


def _circle(
    change: Change, fitted: _Fit | None, start: tuple[Float, float], why: str, ball: float
) -> Circle:
    centre = start[0] if fitted is None else fitted.centre
    x, y = change.to_image(np.asarray(centre))
    radius = 0.0 if fitted is None else fitted.contact / change.scale
    confidence = float(np.clip(start[1], 0, 1)) if not why else 0.0
    return Circle((float(x), float(y)), radius, not why, why, confidence)
