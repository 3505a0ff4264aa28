"""The border of a contact, and the profile of a ball next to it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float32, Float64, Intp
from tactile_core.algorithms.circles.circle import BALL, Shape
from tactile_core.algorithms.circles.light import LightModel
from tactile_core.algorithms.circles.press import PressChange


class PROFILE:
    """Parameters of the measurement of profiles.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.
    """

    # [ball radii] Range of the profile. Nearer to the centre the surface is that of the ball.
    # Source: the smallest contact of interest, and far enough outside the largest to see it end.
    smallest = 0.25
    largest = 1.4
    # [ball radii] Spacing of its nodes. Source: by hand, : two standard deviations of the
    # smoothing of the image.
    step = 0.05
    # [working px] Lower bound of the spacing. Source: mathematics; the pixels do not resolve
    # less.
    least_step_px = 1.0
    # [ratio] Sines among which the first estimate is chosen.
    trials: tuple[float, ...] = (-0.3, -0.1, 0.1, 0.25, 0.4, 0.6, 0.8, 1.0)
    # [count] Gauss–Newton steps. More fit the errors of the light at the border. Source: virtual
    # units (ADR 89), among 2 to 4.
    rounds = 2
    # [count] Sectors of the disc; each is left out once. Source: by hand, : an attached shadow is
    # about as wide.
    sectors = 12
    # [ratio] Weight of the bend of the profile, over the mean weight of a node. It bridges nodes
    # whose pixels are hidden.
    smoothness = 0.003
    # [ratio] Upper bound of the sine of the slope. Source: by hand, just below 1.
    steepest_sine = 0.999
    # [logarithm of the intensity] Lower bound of the residual scale of the soft-L1 weights.
    least_residual = 0.005
    # [count] Pixels that are drawn at random, and below which there is no profile.
    most_pixels = 2500
    fewest_pixels = 30


@dataclass(frozen=True, eq=False)
class RadialProfile:
    """Slope along the radius, linear between nodes.

    Attributes
    ----------
    r : (J,) float64
        Distances of the nodes from the centre, ball radii.
    sines : (J,) float64
        Sine of the slope there.
    without : (G, J) float64
        The same without the pixels of each sector; (0, J) if it is not jackknifed.
    """

    r: Float64
    sines: Float64
    without: Float64


def radial_profile(
    change: PressChange,
    light: LightModel,
    deviation: Float64,
    centre: Float64,
    ball: float,
    *,
    jackknifed: bool = True,
) -> RadialProfile | None:
    """Measure the profile of a press by Gauss–Newton with soft-L1 weights.

    Parameters
    ----------
    change : PressChange
        Change of the image by the press.
    light : LightModel
        Forward model of the light.
    deviation : (S, K) float64
        Deviation of its coefficients at this press.
    centre : (2,) float64
        Centre of the ball, in working pixels.
    ball : float
        Radius of the ball, in working pixels.
    jackknifed : bool
        Whether to measure it also without each sector.

    Returns
    -------
    RadialProfile or None
        None where too few pixels are visible.
    """
    pixels = _Pixels.from_change(change, light, deviation, centre, ball)
    if pixels is None:
        return None
    step = max(PROFILE.step, PROFILE.least_step_px / ball)
    last = int((PROFILE.largest - PROFILE.smallest) / step) + 1
    nodes = PROFILE.smallest + step * np.arange(last + 1, dtype=np.float64)
    left = ((pixels.r - nodes[0]) / step).astype(np.intp)
    share = ((pixels.r - nodes[left]) / step).astype(np.float32)
    rest, count = 1 - share, len(nodes)

    def sums(values: Float32, at: Intp, groups: int) -> Float64:
        flat = np.bincount(at, values, groups * count)
        return np.asarray(flat.reshape(groups, -1))

    costs = [sums(pixels.cost(trial), left, 1)[0] for trial in PROFILE.trials]
    sines: Float64 = np.asarray(PROFILE.trials)[np.argmin(costs, axis=0)]
    for step_number in range(PROFILE.rounds):
        now = sines.astype(np.float32)
        sine = rest * now[left] + share * now[left + 1]
        curve, pull = pixels.linearise_cost(sine)
        pull = curve * sine - pull
        last = jackknifed and step_number == PROFILE.rounds - 1
        at, groups = (left + pixels.sector * count, PROFILE.sectors) if last else (left, 1)
        systems = np.stack(
            [
                sums(curve * rest**2, at, groups) + sums(curve * share**2, at + 1, groups),
                sums(curve * share * rest, at, groups),
                sums(pull * rest, at, groups) + sums(pull * share, at + 1, groups),
            ],
            axis=1,
        )  # (G, 3, J)
        whole = systems.sum(0)
        sines = _solve_sines(whole[None])[0]
    without = _solve_sines(whole - systems) if jackknifed else np.empty((0, count))
    return RadialProfile(nodes, sines, without)


@dataclass(frozen=True, eq=False)
class _Pixels:
    """Pixels around a press; along its direction the light of each is a polynomial in the sine."""

    r: Float64
    sector: Intp
    powers: Float32
    seen: Float32
    weight: Float32
    saturated: Bool

    @classmethod
    def from_change(
        cls,
        change: PressChange,
        light: LightModel,
        deviation: Float64,
        centre: Float64,
        ball: float,
    ) -> _Pixels | None:
        x, y = change.disc(centre, PROFILE.largest * ball)
        r = np.hypot(x - centre[0], y - centre[1]) / ball
        pick = np.flatnonzero(r >= PROFILE.smallest)
        pick = np.random.default_rng(0).permutation(pick)[: PROFILE.most_pixels]
        if len(pick) < PROFILE.fewest_pixels:
            return None
        x, y, r = x[pick], y[pick], r[pick]
        xy = np.stack([x, y], 1).astype(np.float64)
        direction = ((xy - centre).T / (r * ball)).astype(np.float32)
        turn = np.arctan2(direction[1], direction[0]) / np.float32(2 * np.pi) + np.float32(0.5)
        place = change.place(xy).T.astype(np.float32)
        seen, precision, saturated = change.values_at(x, y)
        return cls(
            r,
            np.minimum(turn * PROFILE.sectors, PROFILE.sectors - 1).astype(np.intp),
            light.light_at(place).plus(deviation).along(direction),
            seen,
            precision / np.float32(max(light.residual, PROFILE.least_residual) ** 2),
            saturated,
        )

    def cost(self, sine: float) -> Float32:
        """Cost of each pixel, (N,), where all have one sine."""
        error = -self.seen
        for power, coefficients in enumerate(self.powers, 1):
            error += coefficients * np.float32(sine**power)
        # A saturated channel is a lower bound.
        error[self.saturated & (error > 0)] = 0
        return np.asarray(np.sqrt(1 + (self.weight * error * error).sum(0)))

    def linearise_cost(self, sine: Float32) -> tuple[Float32, Float32]:
        """Curvature and derivative of the cost of each pixel by its sine, (N,)."""
        # Horner's scheme for the polynomial and its derivative; it has no constant.
        value = self.powers[-1] * sine
        slope = self.powers[-1].copy()
        for coefficients in self.powers[-2::-1]:
            value += coefficients
            slope *= sine
            slope += value
            value *= sine
        error = value - self.seen
        above = self.saturated & (error > 0)
        error[above] = 0
        slope[above] = 0
        weighted = self.weight * error
        cost = np.sqrt(1 + (weighted * error).sum(0))
        curve = (self.weight * slope * slope).sum(0) / cost
        return curve, (weighted * slope).sum(0) / cost


def _solve_sines(systems: Float64) -> Float64:
    """Solve for the sines at the nodes: diagonals, next to it, and right sides, (G, 3, J)."""
    diagonal, beside, right = systems.transpose(1, 0, 2)
    count = diagonal.shape[1]
    normal = PROFILE.smoothness * diagonal.mean(1)[:, None, None] * _bend(count)
    nodes = np.arange(count)
    normal[:, nodes, nodes] += diagonal
    normal[:, nodes[:-1], nodes[1:]] += beside[:, :-1]
    normal[:, nodes[1:], nodes[:-1]] += beside[:, :-1]
    limit = PROFILE.steepest_sine
    return np.asarray(np.clip(np.linalg.solve(normal, right[..., None])[..., 0], -limit, limit))


@cache
def _bend(count: int) -> Float64:
    """Quadratic form of the bend of a profile."""
    bend = np.diff(np.eye(count), 2, axis=0)
    return np.asarray(bend.T @ bend)


class BORDER:
    """Parameters of the search for the contact radius.

    Nothing sets them from outside: they are relative to the slope or the radius of the ball.

    References
    ----------
    .. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985, section 4.2.
    """

    # [ratio] Slope at the border, over that of the ball. Without smoothing it would be 1. Source:
    # the profile around a ball on a half-space [1]_, smoothed as the image is, has 0.83 for
    # contacts of 0.6 ball radii; 0.8 to 0.84 on layers (``experiments/circle_finding.py``).
    level = 0.82
    left = 0.5  # [ratio] With a smaller slope relative to the ball's the surface has left the ball
    # [ratio] The distance between the places where the slope is this much above and below the
    # level is the width of the border. Source: by hand, : less than the difference between the
    # level and 1.
    margin = 0.08
    # [ball radii] Next to the border, within this distance, the slope inside is smoothed, and
    # measured instead of that of the ball. Source: by hand, : three standard deviations of the
    # smoothing of the image.
    blurred = 0.1
    # [ball radii] Upper bound of the contact radius. Source: by hand, just below the equator.
    largest = 0.98


@dataclass(frozen=True, eq=False)
class Border:
    """Border of a contact, in working pixels.

    Attributes
    ----------
    radius : float
        Contact radius; 0 where too few pixels can be compared.
    disagreement : float
        Standard deviation of the radius by how much the sectors of the disc disagree: their
        jackknife [1]_.
    width : float
        Distance over which the surface leaves the ball. Shadows and smoothing widen it.
    shape : Shape
        Shape of the gel surface with this border.

    References
    ----------
    .. [1] B. Efron and C. Stein, "The jackknife estimate of variance", Annals of Statistics 9(3),
       1981.
    """

    radius: float
    disagreement: float
    width: float
    shape: Shape


NO_BORDER = Border(0.0, np.inf, np.inf, BALL)  # Of a press whose contact is not searched yet


def find_border(
    change: PressChange,
    light: LightModel,
    deviation: Float64,
    centre: Float64,
    ball_radius: float,
    *,
    with_std: bool = True,
) -> Border:
    """Find the radius at which the slope departs from that of the ball.

    How sharply it does depends on the gel, so the slope is measured at every distance from the
    centre, and compared with that of the ball.

    Parameters
    ----------
    change : PressChange
        Change of the image by the press.
    light : LightModel
        Forward model of the light.
    deviation : (S, K) float64
        Deviation of its coefficients at this press.
    centre : (2,) float64
        Centre of the ball, in working pixels.
    ball_radius : float
        In working pixels.
    with_std : bool
        False saves the time of ``disagreement``, which is then infinite.
    """
    found = radial_profile(change, light, deviation, centre, ball_radius, jackknifed=with_std)
    if found is None:
        return NO_BORDER
    radius, inner, outer = (
        _radius(found.r, found.sines, BORDER.level + margin)
        for margin in (0.0, BORDER.margin, -BORDER.margin)
    )
    others = np.array([_radius(found.r, sines, BORDER.level) for sines in found.without])
    disagreement = float(np.sqrt((len(others) - 1) * others.var())) if with_std else np.inf
    on_ball = found.r < radius - BORDER.blurred
    shape = Shape(found.r, np.where(on_ball, found.r, found.sines))
    width = outer - inner
    return Border(radius * ball_radius, disagreement * ball_radius, width * ball_radius, shape)


def _radius(r: Float64, sines: Float64, level: float) -> float:
    """Distance at which the slope falls below a level of that of the ball, interpolated."""
    ratio = sines / r
    left = np.flatnonzero(ratio < BORDER.left)
    end = left[0] if len(left) else len(r) - 1
    above = np.flatnonzero(ratio[:end] >= level)
    if not len(above):
        return float(r[0])
    i = above[-1]
    share = (ratio[i] - level) / (ratio[i] - ratio[i + 1])
    return min(float(r[i] + share * (r[i + 1] - r[i])), BORDER.largest)
