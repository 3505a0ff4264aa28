"""Whether something else touches beside the ball: more light there than beside the other balls."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.calibration.presses import FoundPress


class BESIDE:
    """Parameters of the search for a second contact. Nothing sets them: they are ratios."""

    # [ball radii] What is farther from the centre is beside the ball. Source: chosen on virtual
    # rigs: a second contact may overlap the first one, and the gel around a contact is steep as
    # well.
    far_balls: tuple[float, ...] = (1.4, 1.7)
    # [ratio] A larger brightening than that of most presses times this is a second contact.
    # Source: chosen on virtual rigs (``benchmarks/guided_calibration.py``): two contacts begin at
    # 2.4, and single balls reach 2.2. Those of two real sensors reach 1.7.
    typical = 2.3
    # [count] From this number of presses on, most of them are single balls. Source: definition:
    # the fewest with a median that two bad presses cannot move far.
    fewest_presses = 5
    # [ratio] Largest brightening beside the ball before there are so many. Source: by hand, :
    # about half that of an equal ball.
    largest = 0.9
    # [ball radii] Radius over which the change is averaged. Source: that of the circle search
    # (``START.blur_radii``).
    blur_balls = 0.35


def brightening(press: FoundPress) -> Float64:
    """Return how much brighter some place beside the ball has become.

    Light that a slope reflects into the camera is brighter; the shadow of the ball, which may be
    long, is not.

    Returns
    -------
    (len(BESIDE.far_balls),) float64
        For each distance from the centre, over the brightening on the ball and over the radius of
        the contact in ball radii, with which it grows; 0 where the image ends before it.
    """
    assert press.start is not None
    change, ball = press.start.shading.change, press.start.ball
    brighter = (np.maximum(change.weighted, 0) ** 2).sum(2)
    sigma = BESIDE.blur_balls * ball
    total = np.maximum(cv2.GaussianBlur(change.weight, (0, 0), sigma), 0.1)
    local = cv2.GaussianBlur(brighter, (0, 0), sigma) / total
    x, y = change.to_working(np.asarray(press.centre_px))
    h, w = local.shape
    distance = np.hypot(np.arange(w) - x, np.arange(h)[:, None] - y)
    on_ball = float(local.max(where=distance < ball, initial=1e-30))
    most = [
        float(local.max(where=distance > balls * ball, initial=0)) for balls in BESIDE.far_balls
    ]
    return np.sqrt(np.array(most) / on_ball) * press.ball_radius_px / press.radius_px


def with_something_beside(presses: Mapping[str, Float64]) -> set[str]:
    """Return the presses beside which something else touches.

    How bright a gel becomes around a single ball depends on the sensor, so that each press is
    compared with the median of all.

    Parameters
    ----------
    presses : mapping of str to (len(BESIDE.far_balls),) float64
        Brightening of each press by its name; of single balls for the most part.
    """
    if len(presses) < BESIDE.fewest_presses:
        return {name for name, found in presses.items() if found.min() > BESIDE.largest}
    largest = BESIDE.typical * np.median(list(presses.values()), axis=0)
    return {name for name, found in presses.items() if (found > largest).any()}
