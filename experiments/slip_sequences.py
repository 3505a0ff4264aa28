"""Virtual objects pressed on the gel and sheared or twisted until they slip, with ground truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core import load_profile
from tactile_core.builtin.contact import Displacement
from tactile_core.builtin.imprint_motion import MotionOfImprint
from tactile_core.builtin.optical_flow import ShearOfContact
from tactile_core.builtin.slip import Slip
from tactile_core.builtin.slip_contact import SlipContactFinder
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.pipeline.chain import Chain
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    ContactMask,
    ContactShear,
    DisplacementField,
    HeightMap,
    MarkerField,
    Quantity,
    SlipState,
)
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter

SHRUNK = 4
"""Image reduction factor. Number and pitch of the markers and the noise in mm stay the same."""

NOISE_PX = 0.1
"""Standard deviation of the marker noise, px of the full image."""
GROSS, HALF = 0.02, 0.5
"""Stick shares below which slip is gross, or covers most of the contact."""

_MOST_STEPS, _AFTER_GROSS = 60, 8
"""Largest number of moves, and number of moves after gross slip."""
KINDS = ("sphere", "cylinder", "rectangle", "disc", "plate", "cylinder")


@dataclass(frozen=True)
class Plan:
    """One object, its press and its motion.

    Attributes
    ----------
    kind : str
        One of :data:`KINDS`.
    shape, options : str, dict
        Kind and options of the indenter.
    turned : bool
        The object is twisted instead of sheared.
    step : float
        Motion per frame: mm, or degrees if twisted.
    speed_mm_s : float or None
        None is quasi-static.
    """

    kind: str
    shape: str
    options: dict[str, Any]
    friction: float
    depth_mm: float
    press_frames: int
    place_mm: tuple[float, float]
    angle_deg: float
    turned: bool
    step: float
    direction_rad: float
    speed_mm_s: float | None
    seed: int
    profile: str = "hex_fingertip"
    most_steps: int = _MOST_STEPS
    overrides: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Look:
    """Inputs of the steps of slip for one frame, and the ground truth.

    Attributes
    ----------
    moving : bool
        False during the press.
    moved : float
        Motion since the press; mm or degrees.
    stick_share : float
        Sticking share of the visible contact.
    """

    markers: MarkerField
    displacement: DisplacementField
    height: HeightMap
    contact: ContactMask
    moving: bool
    moved: float
    stick_share: float


def plans(count: int, seed: int, *, turned: bool) -> list[Plan]:
    """Draw objects, frictions, depths, positions, directions and speeds at random."""
    return [
        plan_of(np.random.default_rng([seed, i, turned]), KINDS[i % len(KINDS)], turned=turned)
        for i in range(count)
    ]


def plan_of(rng: np.random.Generator, kind: str, *, turned: bool) -> Plan:
    """Draw an object of a kind and its motion."""
    shape, options, depth = {
        "sphere": ("sphere", {"diameter_mm": rng.uniform(8, 30)}, rng.uniform(0.25, 0.8)),
        "cylinder": (
            "cylinder",
            {"diameter_mm": rng.uniform(10, 40), "length_mm": rng.uniform(8, 30)},
            rng.uniform(0.15, 0.5),
        ),
        "rectangle": (
            "flat",
            {"size_mm": (rng.uniform(5, 12), rng.uniform(4, 10))},
            rng.uniform(0.05, 0.3),
        ),
        "disc": ("flat", {"diameter_mm": rng.uniform(5, 12.5)}, rng.uniform(0.05, 0.3)),
        "plate": ("flat", {"size_mm": (40.0, 40.0)}, rng.uniform(0.05, 0.12)),
    }[kind]
    step = rng.uniform(0.2, 1.0) if turned else np.exp(rng.uniform(np.log(0.018), np.log(0.08)))
    speed = None if rng.random() < 0.5 else float(np.exp(rng.uniform(np.log(0.03), np.log(1.0))))
    return Plan(
        kind,
        shape,
        options,
        friction=rng.uniform(0.2, 1.0),
        depth_mm=depth,
        press_frames=int(rng.integers(1, 4)),
        place_mm=(rng.uniform(-2, 2), rng.uniform(-1.5, 1.5)),
        angle_deg=rng.uniform(0, 180),
        turned=turned,
        step=float(step) * (rng.choice([-1, 1]) if turned else 1),
        direction_rad=rng.uniform(0, 2 * np.pi),
        speed_mm_s=speed,
        seed=int(rng.integers(2**31)),
    )


def small_profile(plan: Plan) -> Profile:
    """The plan's profile with a smaller image."""
    image = load_profile(plan.profile).image
    size = {
        "width_px": image.width_px // SHRUNK,
        "height_px": image.height_px // SHRUNK,
        "mm_per_px": image.mm_per_px * SHRUNK,
    }
    gel = {"friction": plan.friction, **plan.overrides}
    return load_profile(plan.profile, sim=True, overrides={"image": size, "gel": gel})


def pressed_looks(plan: Plan, watch: SlipWatch, surface: GelSurface) -> Iterator[Look]:
    """Touch the surface with the plan's object and press it."""
    x, y = plan.place_mm
    indenter = make_indenter(plan.shape, **plan.options)
    surface.indent_with(indenter, x_mm=x, y_mm=y, angle_deg=plan.angle_deg)
    yield watch.look(surface, 0.0, moving=False)
    for share in np.arange(1, plan.press_frames + 1) / plan.press_frames:
        surface.press(depth_mm=share * plan.depth_mm, steps=max(1, 4 // plan.press_frames))
        yield watch.look(surface, 0.0, moving=False)


def looks(plan: Plan) -> Iterator[Look]:
    """Press, then move until after gross slip."""
    profile = small_profile(plan)
    watch = SlipWatch(profile, plan.seed)
    surface = GelSurface(profile, "fast")
    yield from pressed_looks(plan, watch, surface)
    radius_mm = 4.0
    travel = np.radians(abs(plan.step)) * radius_mm if plan.turned else plan.step
    seconds = None if plan.speed_mm_s is None else travel / plan.speed_mm_s
    slipped = 0
    for number in range(1, plan.most_steps + 1):
        if plan.turned:
            surface.twist(plan.step, seconds=seconds)
        else:
            along, down = np.cos(plan.direction_rad), np.sin(plan.direction_rad)
            surface.shear(plan.step * along, plan.step * down, seconds=seconds)
        look = watch.look(surface, number * plan.step, moving=True)
        yield look
        slipped += look.stick_share < GROSS
        if slipped > _AFTER_GROSS:
            return


class SlipWatch:
    """Observes a virtual gel surface by noisy markers, true height and true contact."""

    def __init__(self, profile: Profile, seed: int, pitch_mm: float = 1.1) -> None:
        self.context = SensorContext(profile.image, profile.gel)
        self._displacement = Displacement(Displacement.Options(), self.context)
        self._rng = np.random.default_rng(seed)
        image = profile.image
        pitch_px = pitch_mm / image.mm_per_px
        columns = np.arange(pitch_px / 2, image.width_px - 1, pitch_px)
        rows = np.arange(pitch_px / 2, image.height_px - 1, pitch_px)
        self._markers_px = np.stack(np.meshgrid(columns, rows), -1).reshape(-1, 2)
        self._noise_px = NOISE_PX / SHRUNK

    def look(self, surface: GelSurface, moved: float, *, moving: bool) -> Look:
        """Observe the current state."""
        scale = self.context.image.mm_per_px
        truth = surface.truth()
        noise = self._rng.normal(0, self._noise_px, self._markers_px.shape)
        count = len(self._markers_px)
        markers = MarkerField(
            np.arange(count, dtype=np.int32),
            self._markers_px.astype(np.float32),
            (surface.carried_px(self._markers_px) + noise).astype(np.float32),
            np.ones(count, np.bool_),
            scale,
            surface.time_s,
        )
        contact = ContactMask(truth.contact, scale, surface.time_s)
        touched = int(truth.contact.sum())
        return Look(
            markers,
            self._displacement.estimate(markers, contact),
            HeightMap(truth.height_mm, np.ones_like(truth.contact), scale, surface.time_s),
            contact,
            moving,
            moved,
            float(truth.stick.sum()) / touched if touched else 1.0,
        )


@dataclass(frozen=True, eq=False)
class Judged:
    """Results of ``core.slip`` on one sequence while the object moves.

    Attributes
    ----------
    plan : Plan
    stick_share : (n,)
        True sticking share of the visible contact.
    states : tuple of SlipState
    """

    plan: Plan
    stick_share: NDArray[np.float64]
    states: tuple[SlipState, ...]

    @property
    def degree(self) -> NDArray[np.float64]:
        """(n,) degree of slip."""
        return np.array([state.degree for state in self.states])

    @property
    def alarm(self) -> NDArray[np.bool_]:
        """(n,) whether incipient or gross slip is reported."""
        return np.array([state.state in ("incipient", "slip") for state in self.states])

    @property
    def gross(self) -> NDArray[np.bool_]:
        """(n,) whether slip is truly gross."""
        return self.stick_share < GROSS


class SlipSteps:
    """The steps from a displacement field to the slip state, with their default options.

    Attributes
    ----------
    shear : Quantity or None
        Evidence of the field in the last frame.
    """

    def __init__(self, context: SensorContext) -> None:
        self.shear: Quantity | None = None
        self._chain = Chain(
            {
                "slip_contact": SlipContactFinder(Options(), context),
                "shear": ShearOfContact(ShearOfContact.Options(), context),
                "imprint": MotionOfImprint(Options(), context),
                "slip": Slip(Slip.Options(), context),
            }
        )

    def state(self, *given: Quantity, tare: bool = False) -> SlipState:
        """Run the steps on what came with one frame."""
        found = self._chain.run({type(one): one for one in given}, tare=tare)
        self.shear = found.by_type.get(ContactShear)
        state = found.by_type[SlipState]
        assert isinstance(state, SlipState)
        return state

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._chain.reset()


def judged(plan: Plan, *, with_height: bool = True) -> Judged:
    """Run a plan's sequence through the steps of slip."""
    steps = SlipSteps(SensorContext(*_parts(plan)))
    shares, states = [], []
    for look in looks(plan):
        optional = (look.height, look.contact) if with_height else ()
        state = steps.state(look.displacement, *optional)
        if look.moving:
            shares.append(look.stick_share)
            states.append(state)
    return Judged(plan, np.array(shares), tuple(states))


def _parts(plan: Plan) -> tuple[Any, Any]:
    profile = small_profile(plan)
    return profile.image, profile.gel
