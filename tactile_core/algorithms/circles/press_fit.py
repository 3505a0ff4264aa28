"""Joint fit of a single press: its centre, its contact and the light at its place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.types import Float32, Float64
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.light import LightModel, Samples, residuals, samples_on
from tactile_core.algorithms.circles.press import PressChange, disc


class PRESS_FIT:
    """Parameters of the fit of single presses.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.
    """

    # [ball radii] Smaller contacts are excluded. The light is always fitted at least this far.
    smallest_contact = 0.3
    # [ratio] Slope at the border of the contact, over that of the ball. Without smoothing it would
    # be 1. Source: the profile around a ball on a half-space, smoothed as the image is, has 0.83
    # for contacts of 0.6 ball radii; 0.8 to 0.84 on layers.
    level = 0.82
    # [logarithm of the intensity] Lower bound of the residual scale of the soft-L1 weights.
    least_residual = 0.005
    # [ratio] Degrees of freedom of the prior, Student's t, relative to the number of
    # coefficients. Of its tails one step sees nothing: without deviation it weighs (1 + tail) /
    # tail times as much as a normal distribution. Source: by hand, on virtual units
    # (``experiments/circle_finding.py``).
    tail = 0.3


@dataclass(eq=False)
class PressFit:
    """State of a press during the fit, in working pixels.

    Attributes
    ----------
    change : PressChange
        Change of the image by the press.
    ball : float
        Radius of the ball.
    start, centre : (2,) float64
        First and present estimate of the centre.
    contact : float
        Contact radius, in ball radii.
    decay : float
        Distance over which the slope falls by e around the contact, in ball radii.
    square : (S, K) float64
        Expected square of the deviation of the light's coefficients at this press, less for a
        press that deviates more than the others.
    covariance : (4, 4) float64
        Of the unknowns of :meth:`fit_step`, by how much the sectors of the disc disagree [1]_.
    residual : float
        Median residual; infinite where too few pixels are visible.

    References
    ----------
    .. [1] K.-Y. Liang and S. L. Zeger, "Longitudinal data analysis using generalized linear
       models", Biometrika 73(1), 1986.
    """

    change: PressChange
    ball: float
    start: Float64
    centre: Float64 = field(init=False)
    contact: float = 0.65  # [ball radii] Contact radius until the light is known.
    decay: float = 0.25
    square: Float64 = field(init=False)
    covariance: Float64 = field(init=False)
    residual: float = np.inf

    def __post_init__(self) -> None:
        self.centre = self.start

    def samples(self) -> Samples:
        """Pixels on the ball, to fit the light to."""
        reach = np.clip(0.95 * self.contact, PRESS_FIT.smallest_contact, 0.9)
        return samples_on(self.change, self.centre, float(reach) * self.ball, self.ball, 400)

    def fit_step(self, light: LightModel, *, free: int = 4) -> Float64:
        """Return a Gauss–Newton step with soft-L1 weights.

        The unknowns are the centre, the contact radius, the logarithm of the decay, all in ball
        radii, and the deviations of the light's coefficients, from none on. The prior of the
        deviations has the width ``light.spread``. It keeps what the other presses determine; where
        the common light is wrong, the symmetry of the press itself decides.

        Parameters
        ----------
        light : LightModel
        free : int
            2 holds contact and decay.

        Returns
        -------
        (4,) float64
            Of the first four unknowns; 0 where too few pixels are visible.
        """
        spread = np.maximum(light.spread, 1e-6).T
        self.square = spread.T**2
        self.covariance = np.full((4, 4), np.inf)
        self.residual = np.inf
        step = np.zeros(4)
        # [ball radii] Distance from the contact within which the press is fitted. The slope changes
        # most there; farther out there are cast shadows. Source: virtual units
        # (``experiments/circle_finding.py``).
        reach = (self.contact + 0.2) * self.ball
        samples = samples_on(self.change, self.centre, reach, self.ball, 800)
        if samples.change.shape[1] < 30:
            return step
        predicted, columns, angle = self._linearise(light, samples)
        error = predicted - samples.change
        above = samples.saturated & (error > 0)
        error[above] = 0
        unit = max(light.residual, PRESS_FIT.least_residual)
        weight = samples.precision / np.float32(unit**2)
        weight = weight / np.sqrt(1 + (weight * error * error).sum(0))
        weight[above] = 0
        weighted = columns * weight[:, None] / np.float32(self.change.grain_px2)
        normal = (weighted @ columns.swapaxes(1, 2)).astype(np.float64)
        right = (weighted @ error[..., None]).astype(np.float64)
        tail = (1 + PRESS_FIT.tail) / PRESS_FIT.tail
        inverse = np.linalg.inv(
            normal[:, 4:, 4:] + tail * spread[..., None] ** -2.0 * np.eye(spread.shape[1])
        )
        # Eliminates the deviations of each channel, which leaves the first unknowns.
        gain = normal[:, :4, 4:] @ inverse
        reduced = (normal[:, :4, :4] - gain @ normal[:, 4:, :4]).sum(0)
        reduced += (1e-9 * np.trace(reduced) + 1e-12) * np.eye(4)
        pull = (right[:, :4] - gain @ right[:, 4:]).sum(0)[:, 0]
        step[:free] = -np.linalg.solve(reduced[:free, :free], pull[:free])
        deviation = -inverse @ (right[:, 4:] + normal[:, 4:, :4] @ step[:, None])
        variance = np.diagonal(inverse, axis1=1, axis2=2)
        self.square = (tail * deviation[..., 0] ** 2 + variance).T
        # Errors of the light and cast shadows are alike within a sector: it counts as one
        # observation.
        by_unknown = weighted[:, :4] - gain.astype(np.float32) @ weighted[:, 4:]
        pulls = (by_unknown * error[:, None]).sum(0)
        # [count] Sectors of the disc whose residuals are independent of each other: an attached
        # shadow is about as wide.
        sector = ((angle / (2 * np.pi) + 0.5) * 12).astype(np.intp)
        sums = np.linalg.solve(reduced, [np.bincount(sector, each) for each in pulls])
        self.covariance = sums @ sums.T
        shapes = np.broadcast_to(step[:, None], (len(deviation), 4, 1))
        taken = np.concatenate([shapes, deviation], axis=1).astype(np.float32)
        predicted += (taken.swapaxes(1, 2) @ columns)[:, 0]
        off = residuals(predicted, samples.change, samples.precision, samples.saturated)
        self.residual = quantile(off, 0.5)
        return step

    def _linearise(self, light: LightModel, samples: Samples) -> tuple[Float32, Float32, Float32]:
        """Predict the change of some pixels.

        Returns
        -------
        predicted : (K, N) float32
        columns : (K, 4 + S, N) float32
            Its derivatives by the unknowns of :meth:`fit_step`.
        angle : (N,) float32
            Direction of the pixels from the centre, radians.
        """
        x, y = ((samples.xy - self.centre[:, None]) / self.ball).astype(np.float32)
        slope = slope_around(np.hypot(x, y), self.contact, self.decay)
        here = light.light_at(samples.place)
        slopes, *by_normal = here.slopes_and_derivatives(np.stack([x, y]) * slope.ratio)
        by_x, by_y = (here.of_slopes(by) for by in by_normal)
        along = by_x * x + by_y * y
        columns = np.empty((len(by_x), 4 + len(slopes), len(x)), np.float32)
        columns[:, 0] = -by_x * slope.ratio - along * slope.bend * x
        columns[:, 1] = -by_y * slope.ratio - along * slope.bend * y
        columns[:, 2] = along * slope.by_contact
        columns[:, 3] = along * slope.by_decay
        columns[:, 4:] = slopes
        return here.of_slopes(slopes), columns, np.arctan2(y, x)

    def move(self, step: Float64) -> float:
        """Take a step, which is bounded; return by how many working pixels the centre moves."""
        shift = step[:2] * min(1.0, 0.25 / max(float(np.hypot(*step[:2])), 1e-9))
        self.centre = self.centre + shift * self.ball
        # Up to just below the equator.
        self.contact = float(np.clip(self.contact + np.clip(step[2], -0.1, 0.1), 0.25, 0.98))
        self.decay = float(np.clip(self.decay * np.exp(np.clip(step[3], -0.3, 0.3)), 0.02, 1.0))
        return float(np.hypot(*shift)) * self.ball

    @property
    def visible_share(self) -> float:
        """Share of the contact that is inside the image."""
        radius = self.contact * self.ball
        columns, _ = disc(np.ones(self.change.shape), self.centre, radius)
        return len(columns) / max(np.pi * radius**2, 1.0)

    @property
    def centre_std(self) -> float:
        """Standard deviation of a coordinate of the centre, in ball radii."""
        # [ratio] Over the disagreement of the sectors, for a coverage of 68 % on virtual units
        # (``experiments/circle_finding.py``)
        return 2.5 * float(np.sqrt(np.trace(self.covariance[:2, :2]) / 2))

    def circle(self) -> Circle:
        """Return the circle in image coordinates."""
        x, y = self.change.to_image(self.centre)
        ball_px = self.ball / self.change.scale
        radius_std = 7.4 * float(np.sqrt(self.covariance[2, 2]))  # [ratio] as for the centre
        return Circle(
            (float(x), float(y)),
            self.contact * ball_px,
            centre_std_px=self.centre_std * ball_px,
            radius_std_px=radius_std * ball_px,
        )


class SlopeAround(NamedTuple):
    """Slope of the gel at some distances from the centre of a ball, over that of the ball.

    Attributes
    ----------
    ratio : (N,) float32
    bend, by_contact, by_decay : (N,) float32
        Its derivatives by the distance, over the distance; by the contact radius; and by the
        logarithm of the decay.
    """

    ratio: Float32
    bend: Float32
    by_contact: Float32
    by_decay: Float32


def slope_around(r: Float32, contact: float, decay: float) -> SlopeAround:
    """Describe how the surface leaves the ball: the slope falls exponentially around the contact.

    How far depends on the gel, on smoothing and on light that scatters in it.

    Parameters
    ----------
    r : (N,) float32
        Distances from the centre, ball radii.
    contact, decay : float
        In ball radii.
    """
    beyond = (r - np.float32(contact)) / np.float32(decay)
    ratio = np.minimum(np.float32(PRESS_FIT.level) * np.exp(-beyond), np.float32(1))
    steep = np.where(ratio < 1, ratio / np.float32(decay), np.float32(0))
    bend = -steep / np.maximum(r, np.float32(1e-6))
    by_decay = np.asarray(steep * beyond * np.float32(decay), np.float32)
    return SlopeAround(ratio, np.asarray(bend, np.float32), steep, by_decay)
