"""What examination and score share: a sensor's conditioning, its ball and its calibrator."""

from __future__ import annotations

from math import atan2, degrees, hypot, radians, tan
from typing import Self

from tactile_core.algorithms.circles import Circle, Start, working_scale
from tactile_core.algorithms.dome import flat_equivalent
from tactile_core.calibration.ball_sizes import check_ball
from tactile_core.calibration.fitted_bundle import conditioning_for
from tactile_core.calibration.gel_shape import dome_radius_px, thickness_of
from tactile_core.calibration.press_search import press_image
from tactile_core.calibration.presses import FoundPress
from tactile_core.errors import InputError
from tactile_core.interfaces.calibrator import Calibrator
from tactile_core.plugins.calibrators import calibrator_of
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference

NOWHERE = Circle((0.0, 0.0), 0.0, used=False)  # Circle of a press that has not been searched


class BENCH:
    """Parameters of what can be calibrated on. Nothing sets them from outside."""

    # [deg] A ball whose slope stays below this in the whole view teaches nothing. Source: by
    # hand, : little more than the error of a good calibration.
    least_slope_deg = 5.0


class Bench:
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
    def of(
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
        calibrator = calibrator_of(profile.calibration, model)
        return cls(profile, reference, ball_diameter_mm, calibrator)

    def prepared(self, name: str, frame: Frame) -> FoundPress:
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
            start=Start.of(image, self.touching_px, working_scale(self.touching_px)),
            thickness_mm=self._thickness_mm,
            for_heights=self.calibrator.fits == "heights",
        )


def _check_slopes(ball_diameter_mm: float, profile: Profile) -> None:
    """Refuse a ball that is nearly flat over the view."""
    image = profile.image
    reach_mm = hypot(image.width_px, image.height_px) / 2 * image.mm_per_px
    slope_deg = degrees(atan2(reach_mm, ball_diameter_mm / 2))
    if slope_deg < BENCH.least_slope_deg:
        most_mm = 2 * reach_mm / tan(radians(BENCH.least_slope_deg))
        raise InputError(
            f"a ball of {ball_diameter_mm:g} mm is nearly flat over a view of "
            f"{image.width_px * image.mm_per_px:.3g} mm; press one of at most {most_mm:.3g} mm, or "
            f"correct --ball-diameter-mm"
        )
