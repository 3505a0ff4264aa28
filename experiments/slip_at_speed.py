"""Virtual objects sheared or turned at speed, and controls that are held, with ground truth.

Half of the objects move at 0.3 to 1 mm/s; the others slip within 4 to 12 frames of a camera with
30 Hz. Three in eight are plates wider than the view. Friction, friction law and gel differ. A
control moves like its object until a fifth of the contact slips, rests for eight frames, and moves
back.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from experiments.slip_sequences import (
    GROSS,
    Look,
    Plan,
    SlipSteps,
    SlipWatch,
    plan_of,
    pressed_looks,
    small_profile,
)
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.quantities import ContactShear, SlipState
from tactile_sim.gel_surface import GelSurface

MINI = Path(__file__).resolve().parent / "profiles" / "mini_marked_virtual.yaml"
KINDS = ("plate", "sphere", "plate", "cylinder", "disc", "plate", "rectangle", "cylinder")

_MOST_STEPS, _AFTER_GROSS, _REST = 45, 8, 8
"""Largest number of moves, moves after gross slip, and frames of rest of a control."""
_LEVER_MM, _RATE_HZ = 4.0, 30.0
_HELD_SHARE, _MOST_HELD = 0.8, 10
"""Stick share at which a control stops, and its largest number of moves."""
_MARGIN = 1.5
"""Distance to gross slip relative to that of uniform pressure on a half space and a layer."""


@dataclass(frozen=True)
class Case:
    """One object that is moved at speed.

    Attributes
    ----------
    plan : Plan
    at_camera_rate : bool
        Whether it slips within some frames of a camera with 30 Hz.
    frames : float
        Number of those frames, approximately.
    """

    plan: Plan
    at_camera_rate: bool
    frames: float


@dataclass(frozen=True)
class Passage:
    """Frames in which an object moved: the true stick share, the state, and its shear."""

    case: Case
    held: bool
    stick_share: np.ndarray
    states: tuple[SlipState, ...]
    shears: tuple[ContactShear, ...]

    @property
    def degree(self) -> np.ndarray:
        """(n,) degree of slip."""
        return np.array([state.degree for state in self.states])

    @property
    def alarm(self) -> np.ndarray:
        """(n,) whether incipient or gross slip is reported."""
        return np.array([state.state in ("incipient", "slip") for state in self.states])

    @property
    def first_gross(self) -> int:
        """First frame of gross slip; the number of frames if there is none."""
        gross = self.stick_share < GROSS
        return int(np.argmax(gross)) if gross.any() else len(gross)


def case(seed: int) -> Case:
    """Draw an object; a third of them is turned."""
    rng = np.random.default_rng([seed, 99])
    kind, turned = KINDS[seed % len(KINDS)], (seed // len(KINDS)) % 3 == 2
    plan = plan_of(rng, kind, turned=turned)
    fast = rng.random() >= 0.5
    if not fast:
        plan = replace(plan, speed_mm_s=float(np.exp(rng.uniform(np.log(0.3), 0))))
    else:
        law = int(rng.integers(3))
        gel = {
            "friction_speed_mm_s": None if law < 2 else float(rng.uniform(20, 100)),
            "kinetic_friction": plan.friction * float(rng.uniform(0.5, 0.9)) if law == 1 else None,
        }
        profile = str(MINI) if rng.random() < 0.4 else plan.profile
        plan = replace(plan, overrides=gel, profile=profile)
    return Case(plan, fast, float(rng.uniform(4, 12)))


def passages(seed: int) -> list[Passage]:
    """Measure an object, and its control unless it slips from the beginning."""
    drawn = case(seed)
    moved = _passage(drawn, None)
    loosens = moved.stick_share < _HELD_SHARE
    stop = int(np.argmax(loosens)) if loosens.any() else len(loosens) // 2
    return [moved] if stop < 2 else [moved, _passage(drawn, min(stop, _MOST_HELD))]


def _passage(drawn: Case, stop: int | None) -> Passage:
    profile = small_profile(drawn.plan)
    steps = SlipSteps(SensorContext(profile.image, profile.gel))
    shares, states, shears = [], [], []
    for look in _looks(drawn, stop):
        state = steps.state(look.markers, look.displacement, look.height, look.contact)
        if look.moving:
            shares.append(look.stick_share)
            states.append(state)
            assert isinstance(steps.shear, ContactShear)
            shears.append(steps.shear)
    return Passage(drawn, stop is not None, np.array(shares), tuple(states), tuple(shears))


def _looks(drawn: Case, stop: int | None) -> Iterator[Look]:
    """Press, then move until after gross slip, or until a stop, rest and move back."""
    plan, profile = drawn.plan, small_profile(drawn.plan)
    pitch_mm = profile.gel.markers.pitch_mm if "mini" in plan.profile else 1.1
    watch, surface = SlipWatch(profile, plan.seed, pitch_mm), GelSurface(profile, "fast")
    yield from pressed_looks(plan, watch, surface)
    step, seconds = _pace(drawn, surface)
    move = (
        partial(surface.twist, step) if plan.turned else partial(surface.shear, *_along(plan, step))
    )
    back = (
        partial(surface.twist, -step)
        if plan.turned
        else partial(surface.shear, *_along(plan, -step))
    )
    slipped = 0
    for _ in range(_MOST_STEPS if stop is None else stop):
        move(seconds=seconds)
        look = watch.look(surface, 0.0, moving=True)
        yield look
        slipped += look.stick_share < GROSS
        if slipped > _AFTER_GROSS and stop is None:
            return
    if stop is None:
        return
    for _ in range(_REST):
        surface.hold(seconds)
        yield watch.look(surface, 0.0, moving=True)
    for _ in range(stop):
        back(seconds=seconds)
        yield watch.look(surface, 0.0, moving=True)


def _along(plan: Plan, step: float) -> tuple[float, float]:
    return step * np.cos(plan.direction_rad), step * np.sin(plan.direction_rad)


def _pace(drawn: Case, surface: GelSurface) -> tuple[float, float]:
    """Motion per frame, mm or degrees, and its duration, s."""
    plan = drawn.plan
    if not drawn.at_camera_rate:
        assert plan.speed_mm_s is not None
        travel_mm = np.radians(abs(plan.step)) * _LEVER_MM if plan.turned else plan.step
        return plan.step, float(travel_mm / plan.speed_mm_s)
    elastomer, pressure = surface.gel.elastomer, surface.state.pressure_mpa
    area_mm2 = np.count_nonzero(pressure) * surface.grid.cell_mm2
    force_n = pressure.sum() * surface.grid.cell_mm2
    radius_mm = np.sqrt(area_mm2 / np.pi)
    modulus = elastomer.shear_modulus_mpa
    # a layer in simple shear beside a circle on a half space (Cattaneo and Mindlin)
    stiffness = area_mm2 * modulus / elastomer.thickness_mm
    stiffness += 16 * modulus * radius_mm / (3 * (2 - elastomer.poisson_ratio))
    step_mm = _MARGIN * plan.friction * force_n / stiffness / drawn.frames
    if not plan.turned:
        return float(step_mm), 1 / _RATE_HZ
    lever_mm = max(min(radius_mm, _LEVER_MM), 0.5)
    return float(np.degrees(_MARGIN * step_mm / lever_mm) * np.sign(plan.step)), 1 / _RATE_HZ
