"""Examines a touch beside the stream."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import atan2, degrees, hypot, radians, tan
from typing import Self

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.finder import find_circles
from tactile_core.algorithms.circles.press import working_scale
from tactile_core.algorithms.circles.start import Start, darkens
from tactile_core.algorithms.heights.sphere import flat_equivalent
from tactile_core.calibration.fitted_bundle import conditioning_for
from tactile_core.calibration.light_range import dome_radius_px, thickness_of
from tactile_core.calibration.press_search import (
    check_ball,
    light_of,
    press_image,
    relocate_press,
)
from tactile_core.calibration.presses import FoundPress, angles_deg
from tactile_core.calibration.result import measured_frames
from tactile_core.errors import CalibrationError, InputError, SequenceError
from tactile_core.interfaces.calibration import Calibrator
from tactile_core.plugins.options import fittable_calibrator, fitted_by
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference


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


def brightening(press: FoundPress) -> Float64:
    """Return how much brighter some place beside the ball has become.

    Light that a slope reflects into the camera is brighter; the shadow of the ball, which may be
    long, is not. Where the image darkens with depth it is how much darker: the gel that a single
    ball presses aside bulges around it, and is brighter.

    Returns
    -------
    (len(BESIDE.far_balls),) float64
        For each distance from the centre, over the brightening on the ball and over the radius of
        the contact in ball radii, with which it grows; 0 where the image ends before it.
    """
    assert press.start is not None
    change, ball = press.start.shading.change, press.start.ball
    sign = np.float32(-1 if darkens([press.start]) else 1)
    brighter = (np.maximum(sign * change.weighted, 0) ** 2).sum(2)
    # [ball radii] Radius over which the change is averaged. Source: that of the circle search
    # (``START.blur_radii``).
    sigma = 0.35 * ball
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
        # [ratio] Largest brightening beside the ball. Source: by hand: about half that of an equal
        # ball.
        return {name for name, found in presses.items() if found.min() > 0.9}
    largest = BESIDE.typical * np.median(list(presses.values()), axis=0)
    return {name for name, found in presses.items() if (found > largest).any()}


NOWHERE = Circle((0.0, 0.0), 0.0, "it has not been searched")


# [deg] A ball whose slope stays below this in the whole view teaches nothing. Source: by
# hand, little more than the error of a good calibration.
_LEAST_SLOPE_DEG = 5.0


class TouchBench:
    """Prepares frames of a ball for the circle search.

    Parameters
    ----------
    profile : Profile
    reference : Reference
        As averaged, without masks.
    ball_diameter_mm : float
    calibrator : Calibrator

    Attributes
    ----------
    condition : Conditioning
    calibrator : Calibrator
    ball_radius_px, touching_px : float
        Radius of the ball, and that of the ball that would touch a flat gel as it does.
    """

    def __init__(
        self,
        profile: Profile,
        reference: Reference,
        ball_diameter_mm: float,
        calibrator: Calibrator,
    ) -> None:
        self.calibrator = calibrator
        self.condition = conditioning_for(profile, reference, calibrator)
        self.ball_radius_px = ball_diameter_mm / 2 / profile.image.mm_per_px
        self._dome_px = dome_radius_px(profile)
        self.touching_px = flat_equivalent(self.ball_radius_px, self._dome_px)
        self._thickness_mm = thickness_of(profile)

    @classmethod
    def for_sensor(
        cls,
        profile: Profile,
        reference: Reference,
        ball_diameter_mm: float,
        model: str | None = None,
    ) -> Self:
        """Make the bench of a sensor.

        Raises
        ------
        InputError, ProfileError, PluginError
            The ball is implausible, or the calibrator cannot be made.
        """
        check_ball(ball_diameter_mm, profile)
        _check_slopes(ball_diameter_mm, profile)
        calibrator = fittable_calibrator(profile.calibration, model)
        return cls(profile, reference, ball_diameter_mm, calibrator)

    def prepare_press(self, name: str, frame: Frame) -> FoundPress:
        """Condition a frame and analyse it on its own; its circle is still :data:`NOWHERE`.

        Raises
        ------
        SequenceError
            An exposure of a sequence is dark, or shows another light than its own.
        """
        ready = self.condition(frame)
        image = press_image(ready, self.condition.undeformed)
        return FoundPress(
            name,
            ready,
            NOWHERE,
            self.ball_radius_px,
            dome_radius_px=self._dome_px,
            start=Start.from_image(image, self.touching_px, working_scale(self.touching_px)),
            thickness_mm=self._thickness_mm,
            for_heights=self.calibrator.fits == "heights",
        )


def _check_slopes(ball_diameter_mm: float, profile: Profile) -> None:
    """Refuse a ball that is nearly flat over the view."""
    image = profile.image
    reach_mm = hypot(image.width_px, image.height_px) / 2 * image.mm_per_px
    slope_deg = degrees(atan2(reach_mm, ball_diameter_mm / 2))
    if slope_deg < _LEAST_SLOPE_DEG:
        most_mm = 2 * reach_mm / tan(radians(_LEAST_SLOPE_DEG))
        raise InputError(
            f"a ball of {ball_diameter_mm:g} mm is nearly flat over a view of "
            f"{image.width_px * image.mm_per_px:.3g} mm; press one of at most {most_mm:.3g} mm, or "
            f"correct --ball-diameter-mm"
        )


_BESIDE = "something else touches next to the ball; press the ball alone"


@dataclass(frozen=True, eq=False)
class Verdict:
    """What the examination of a frame has found.

    Attributes
    ----------
    name : str
        Of the frame.
    circle : Circle
    why : str
        Why it is not kept; empty if it is.
    circles : mapping of str to Circle
        Those of all presses that are kept, as they are found together.
    withdrawn : mapping of str to str
        Earlier presses that are no longer kept, each with the reason.
    """

    name: str
    circle: Circle
    why: str
    circles: dict[str, Circle]
    withdrawn: dict[str, str]


class Examiner:
    """Keeps the presses of a ball, and judges each new one together with them.

    Parameters
    ----------
    bench : TouchBench

    Attributes
    ----------
    kept : list of FoundPress
    """

    def __init__(self, bench: TouchBench) -> None:
        self._bench = bench
        self.kept: list[FoundPress] = []
        self._before: dict[str, list[FoundPress]] = {}
        self._brightening: dict[str, Float64] = {}

    def examine(self, name: str, frame: Frame) -> Verdict:
        """Judge a frame, and keep it if it is a good press."""
        try:
            press = self._bench.prepare_press(name, frame)
        except SequenceError as error:
            return self._verdict(name, NOWHERE, str(error))
        starts = [one.start for one in (*self.kept, press) if one.start is not None]
        *others, circle = find_circles(starts)
        press = replace(press, circle=circle)
        why = circle.why or self._flaw(press)
        if not why:
            self._brightening[name] = brightening(press)
        crowded = with_something_beside(self._brightening)
        if name in crowded:
            why = _BESIDE
        if why:
            # its presence must not change the circles of the others
            return self._verdict(name, circle, why)
        found = [replace(one, circle=c) for one, c in zip(self.kept, others, strict=True)]
        withdrawn = {one.file: one.why for one in found if not one.used}
        withdrawn |= {one.file: _BESIDE for one in found if one.file in crowded}
        self._before[name] = self.kept
        self.kept = [*(one for one in found if one.file not in withdrawn), press]
        return self._verdict(name, circle, "", withdrawn)

    def score(self, name: str) -> float | None:
        """Measure a press that was kept, with a calibration on those that were kept before it.

        As in a fold of ``tactile calibrate``, nothing depends on that press but its own circle,
        which is located by the light of the others.

        Returns
        -------
        float or None
            Mean error of the normals, degrees [1]_. None with fewer than four presses before it,
            whose circles are found with a uniform light, or if they or it cannot be used.

        References
        ----------
        .. [1] A. P. Dawid, "Present Position and Potential Developments: Some Personal Views:
           Statistical Theory: The Prequential Approach", Journal of the Royal Statistical Society
           A 147(2), 1984.
        """
        training = self._before.pop(name)
        press = next((one for one in self.kept if one.file == name), None)
        if press is None or len(training) < 4:
            return None
        undeformed = self._bench.condition.undeformed
        try:
            located = relocate_press(press, light_of(training))
            samples = [one.training() for one in training]
            model = fitted_by(self._bench.calibrator, samples, undeformed)
        except CalibrationError:
            return None
        ((_, measured),) = measured_frames(model, [located], undeformed)
        rows, columns, true = located.true_gradients(located.scored_area())
        found = np.stack([measured.gx[rows, columns], measured.gy[rows, columns]], 1)
        return float(angles_deg(found, true).mean())

    def _verdict(
        self, name: str, circle: Circle, why: str, withdrawn: dict[str, str] | None = None
    ) -> Verdict:
        circles = {press.file: press.circle for press in self.kept}
        return Verdict(name, circle, why, circles, withdrawn or {})

    def _flaw(self, press: FoundPress) -> str:
        """Return why a press whose circle was found is not kept; empty if it is."""
        share = press.radius_px / self._bench.touching_px
        depth_mm = (1 - np.sqrt(max(0.0, 1 - share**2))) * press.ball_diameter_mm / 2
        # [share] Less of the contact inside the image is too little. Source: geometry: the circle
        # is whole but for a pixel's error.
        if visible_share(press) < 0.97:
            return "the image border cuts the contact; press further inside"
        # [ball radii] A smaller contact shows hardly any slopes. Source: by hand, more than the
        # circle search needs (``PRESS_FIT``).
        if share < 0.35:
            return "the contact is too small; press deeper"
        # [share of the gel's thickness] A ball with this contact would be too deep for the gel.
        deepest_mm = 0.75 * press.thickness_mm
        # [ball radii] A larger one is too deep: the sides are dark, and the gel may touch its
        # plate. Source: geometry: the depth of a fifth of the diameter, which the guide asks for,
        # gives 0.63 on a half-space and 0.8 if all of the cap touches, as on a thin layer.
        if share > 0.78 or depth_mm > deepest_mm:
            return "the contact is too large; press less deep"
        # [ball radii] Largest standard deviation of the contact's radius. Source: chosen on virtual
        # rigs (``benchmarks/guided_calibration.py``).
        if press.circle.radius_std_px > 0.25 * press.ball_radius_px:
            return "the contact is not round; press the ball alone, straight down"
        contact = press.area()
        # [share] Largest share of the contact that is saturated
        if press.frame.saturated[contact].any(axis=-1).mean() > 0.2:
            return "much of the contact is saturated; press less deep, or expose for less time"
        return ""


def visible_share(press: FoundPress) -> float:
    """Return the share of the contact's disc that is inside the image."""
    h, w = press.frame.pixels.shape[:2]
    (x, y), r = press.centre_px, press.radius_px
    inside = 1.0
    for place, side in ((x, w), (y, h)):
        for distance in (place + 0.5, side - 0.5 - place):
            # share of a disc beyond a straight line at this distance from its centre
            c = float(np.clip(distance / max(r, 1e-9), -1, 1))
            inside -= (np.arccos(c) - c * np.sqrt(1 - c * c)) / np.pi
    return float(inside)
