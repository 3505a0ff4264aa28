"""A virtual person who presses a ball into a virtual sensor, not always as asked.

The hand is noisy: it misses the place and the depth that it is asked for, trembles, approaches and
lifts through time, and every fifth press is bad in one of nine ways. Each press comes with its
truth.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tactile_core.quantities import Frame
from tactile_sim.indenters import Indenter, make_indenter
from tactile_sim.stage import VirtualStage


class HandParameters(NamedTuple):
    """Parameters of the hand; lengths in ball radii. Nothing sets them: they define the test.

    Attributes
    ----------
    rate_hz : float, Hz
        Frames that the camera takes.
    bad_share : float, share
        Presses that are bad.
    place_std : float, ball radii
        Standard deviation of each coordinate about the place asked for.
    size_std : float, share
        Standard deviation of the contact's radius about the one asked for.
    tremor : float, ball radii
        Random walk of each coordinate from frame to frame while the hand is still.
    depth_tremor : float, share
        Standard deviation of the depth while it is still.
    hold_s : (float, float), s
        Shortest and longest time of being still.
    """

    rate_hz: float = 12.0
    bad_share: float = 0.2
    place_std: float = 0.4
    size_std: float = 0.1
    tremor: float = 0.002
    depth_tremor: float = 0.01
    hold_s: tuple[float, float] = (0.6, 1.0)


HAND = HandParameters()
"""The values in use."""

BAD = (
    "moving",
    "two contacts",
    "finger",
    "edge",
    "beyond the border",
    "too light",
    "too deep",
    "double",
    "slid",
)
"""Ways in which a press is bad."""


@dataclass(frozen=True)
class Attempt:
    """One press of the hand and its truth.

    Attributes
    ----------
    number : int
    bad : str
        How it is bad, one of :data:`BAD`; empty for a good one.
    centre_px : (float, float)
        Where the ball touched first.
    contact_share : float
        Radius of the contact that is meant, in ball radii.
    """

    number: int
    bad: str
    centre_px: tuple[float, float]
    contact_share: float


class Step(NamedTuple):
    """Position of the object in one frame: offset in mm from where it touched, and depth in mm."""

    dx_mm: float
    dy_mm: float
    depth_mm: float


class VirtualHand:
    """A hand with a ball above the virtual sensor of a profile.

    Parameters
    ----------
    profile : str
        A profile's name or path.
    seed : int
        Of the unit and of the hand.
    overrides : mapping, optional
        Profile keys to replace.
    bad_share : float, optional
    kinds : sequence of str, optional
        The ways in which presses are bad.
    """

    def __init__(
        self,
        profile: str,
        seed: int,
        overrides: dict[str, Any] | None = None,
        *,
        bad_share: float = HAND.bad_share,
        kinds: Sequence[str] = BAD,
    ) -> None:
        self.stage = VirtualStage(profile, seed=seed, overrides=overrides)
        self.profile = self.stage.profile
        image = self.profile.image
        self.size_px = np.array([image.width_px, image.height_px])
        self.mm_per_px = image.mm_per_px
        self.thickness_mm = self.stage.gel.elastomer.thickness_mm
        width_mm = image.width_px * image.mm_per_px
        self.ball_mm = round(float(min(0.22 * width_mm, 2 * self.thickness_mm)) / 2, 2)
        self._rng = np.random.default_rng([seed, 11])
        self._bad_share, self._kinds = bad_share, tuple(kinds)
        self._time_s, self._count = 0.0, 0
        self.attempts: list[Attempt] = []
        self.pressing: Attempt | None = None
        """The press under way; None while nothing touches."""
        self._depth_curve = self._depths()

    @property
    def ball_radius_px(self) -> float:
        return self.ball_mm / self.mm_per_px

    def idle(self, frames: int) -> Iterator[Frame]:
        """Take frames without touching anything."""
        for _ in range(frames):
            yield self._frame()

    def press(self, centre_px: Sequence[float], contact_share: float) -> Iterator[Frame]:
        """Press where asked, more or less, and yield the frames from approach to lifting."""
        rng, ball = self._rng, self.ball_radius_px
        bad = str(rng.choice(self._kinds)) if rng.random() < self._bad_share else ""
        share = float(np.clip(contact_share * (1 + HAND.size_std * rng.normal()), 0.42, 0.74))
        at = np.asarray(centre_px) + rng.normal(0, HAND.place_std, 2) * ball
        margin = share * ball + 2
        if bad == "beyond the border":
            inside = rng.uniform(-0.2, 0.45) * share * ball
            side = int(rng.integers(4))
            axis, end = side % 2, side // 2
            at[axis] = inside if end == 0 else self.size_px[axis] - 1 - inside
        else:
            # a person sees the border
            at = np.clip(at, margin, self.size_px - 1 - margin)
        if bad == "too light":
            share = float(rng.uniform(0.12, 0.25))
        gel_mm = self.profile.gel.size_mm
        if gel_mm is not None:  # the view may reach beyond the gel, a press cannot
            half = np.array(gel_mm) / 2 / self.mm_per_px
            middle = (self.size_px - 1) / 2
            at = np.clip(at, middle - half, middle + half)
        depth = self._depth_of(share)
        if bad == "too deep":
            share = float(rng.uniform(0.84, 0.9))
            depth = self._depth_of(share)
        attempt = Attempt(len(self.attempts), bad, (float(at[0]), float(at[1])), share)
        self.attempts.append(attempt)
        self.pressing = attempt
        x_mm, y_mm = (at - (self.size_px - 1) / 2) * self.mm_per_px
        angle = float(rng.uniform(0, 180))
        self.stage.indent_with(self._object(bad), x_mm=x_mm, y_mm=y_mm, angle_deg=angle)
        last = Step(0.0, 0.0, 0.0)
        touched = False
        for step in self._steps(bad, depth):
            yield self._moved(last, step)
            last = step
            touched |= bad == "two contacts" and self._both_touch()
        if bad == "two contacts" and not touched:
            # on a dome the second ball may hang in the air, and this was a good press
            self.attempts[-1] = replace(attempt, bad="")
        self.stage.reset()
        self.pressing = None
        yield from self.idle(int(rng.integers(2, 4)))

    def truth_presses(
        self, count: int, seed: int, *, whole: bool = False
    ) -> Iterator[tuple[Frame, np.ndarray, np.ndarray]]:
        """Yield good presses all over the view: frame, true slopes (H, W, 2) and contact.

        The border may cut up to a fifth of a contact, unless it should be ``whole``.
        """
        rng = np.random.default_rng([seed, 17 if whole else 13])
        for _ in range(count):
            share = float(rng.uniform(0.45, 0.72))
            margin = (1.05 if whole else 0.6) * share * self.ball_radius_px
            at = rng.uniform(margin, self.size_px - 1 - margin)
            x_mm, y_mm = (at - (self.size_px - 1) / 2) * self.mm_per_px
            self.stage.indent_with(self._object(""), x_mm=x_mm, y_mm=y_mm)
            self.stage.press(depth_mm=self._depth_of(share))
            truth = self.stage.truth()
            yield self._frame(), truth.gradients, truth.contact
            self.stage.reset()

    def _steps(self, bad: str, depth: float) -> Iterator[Step]:
        rng, ball = self._rng, self.ball_mm
        way = rng.uniform(0, 2 * np.pi)
        along = np.array([np.cos(way), np.sin(way)])
        at = np.zeros(2)
        for share in np.linspace(0.25, 1, int(rng.integers(3, 6)))[:-1]:
            at = at + rng.normal(0, 2 * HAND.tremor * ball, 2)
            yield Step(*at, share * depth)
        if bad == "slid":
            far = float(rng.uniform(0.5, 1.2))
            for _ in range(4):
                at = at + along * far * ball / 4
                yield Step(*at, depth)
        hold = round(float(rng.uniform(*HAND.hold_s)) * HAND.rate_hz)
        speed = float(rng.uniform(0.06, 0.15)) * ball
        rocks = rng.random() < 0.5
        for n in range(hold):
            at = at + rng.normal(0, HAND.tremor * ball, 2)
            deep = depth * (1 + HAND.depth_tremor * rng.normal())
            if bad == "moving" and rocks:
                deep *= 1 + 0.3 * np.sin(1.8 * n)
            elif bad == "moving":
                at = at + along * speed
            yield Step(*at, deep)
        if bad == "double":
            yield Step(*at, 0.5 * depth)
            yield Step(*at, 0.35 * depth)
            for _ in range(hold):
                at = at + rng.normal(0, HAND.tremor * ball, 2)
                yield Step(*at, depth)
        for share in (0.6, 0.2):
            yield Step(*at, share * depth)

    def _both_touch(self) -> bool:
        """Whether contact is found on the first ball, and farther than it could reach."""
        contact = self.stage.truth().contact
        x, y = self.attempts[-1].centre_px
        h, w = contact.shape
        away = np.hypot(np.arange(w) - x, np.arange(h)[:, None] - y)
        far = away > self.ball_radius_px
        return bool(contact[far].any() and contact[~far].any())

    def _moved(self, last: Step, step: Step) -> Frame:
        """Move the object and take a frame; in a sequence, half of it before the move has ended."""
        before = None
        if self._sequential and self._count_moves(last, step):
            middle = Step(*((a + b) / 2 for a, b in zip(last, step, strict=True)))
            self._to(last, middle)
            before, last = self.stage.frame(), middle
        self._to(last, step)
        frame = self._frame()
        if before is None:
            return frame
        pixels = frame.pixels.copy()
        half = pixels.shape[2] // 2
        pixels[..., :half] = before.pixels[..., :half]
        return replace(frame, pixels=pixels)

    @property
    def _sequential(self) -> bool:
        return self._shots > 1

    @property
    def _shots(self) -> int:
        return self.stage._shots

    def _count_moves(self, last: Step, step: Step) -> bool:
        far = np.hypot(step.dx_mm - last.dx_mm, step.dy_mm - last.dy_mm) / self.ball_mm
        return bool(far > 0.02 or abs(step.depth_mm - last.depth_mm) > 0.05 * step.depth_mm)

    def _to(self, last: Step, step: Step) -> None:
        self.stage.press(depth_mm=step.depth_mm, steps=1)
        dx, dy = step.dx_mm - last.dx_mm, step.dy_mm - last.dy_mm
        if np.hypot(dx, dy) > 1e-6:
            self.stage.shear(dx, dy)

    def _frame(self) -> Frame:
        self._time_s += 1 / HAND.rate_hz
        self._count += 1
        frame = self.stage.frame()
        times = (self._time_s,) * len(frame.exposure_times_s)
        return replace(
            frame, timestamp_s=self._time_s, sequence=self._count, exposure_times_s=times
        )

    def _object(self, bad: str) -> Indenter:
        rng, ball = self._rng, self.ball_mm
        if bad == "two contacts":
            apart = float(rng.uniform(1.5, 3.0)) * ball
            return self._relief(
                lambda x, y: np.maximum(_cap(x, y, ball), _cap(x - apart, y, ball)), 5
            )
        if bad == "finger":
            long, wide = float(rng.uniform(2.6, 4.0)) * ball, float(rng.uniform(1.6, 2.4)) * ball
            return self._relief(lambda x, y: -(x**2 / long + y**2 / wide) / 2, 4)
        if bad == "edge":
            steep, round_mm = float(rng.uniform(0.5, 0.9)), 0.15 * ball
            return self._relief(lambda x, y: -steep * np.hypot(y, round_mm), 4)
        return make_indenter("sphere", diameter_mm=2 * ball)

    def _relief(self, height: Any, radii: float) -> Indenter:
        spacing = self.ball_mm / 40
        side = np.arange(-radii * self.ball_mm, radii * self.ball_mm, spacing)
        x, y = np.meshgrid(side, side)
        return make_indenter("heightmap", height_mm=height(x, y), mm_per_px=spacing)

    def _depths(self) -> tuple[np.ndarray, np.ndarray]:
        """Contact radii in ball radii, and the depths that give them."""
        depths = np.linspace(0.02, min(0.85 * self.ball_mm, 0.92 * self.thickness_mm), 16)
        shares = []
        self.stage.indent_with(make_indenter("sphere", diameter_mm=2 * self.ball_mm))
        for depth in depths:
            self.stage.press(depth_mm=float(depth), steps=1)
            area = float(np.count_nonzero(self.stage.truth().contact)) * self.mm_per_px**2
            shares.append(np.sqrt(area / np.pi) / self.ball_mm)
        self.stage.reset()
        return np.array(shares), depths

    def _depth_of(self, share: float) -> float:
        return float(np.interp(share, *self._depth_curve))


def _cap(x: np.ndarray, y: np.ndarray, ball: float) -> np.ndarray:
    square = ball**2 - x**2 - y**2
    return np.where(square > 0, np.sqrt(np.maximum(square, 0)) - ball, np.nan_to_num(-ball))
