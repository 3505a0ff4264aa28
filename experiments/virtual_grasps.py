"""Virtual grasps and lifts with ground truth: ``python -m experiments.virtual_grasps``.

A gripper presses a virtual sensor on an object that stands on a table, then lifts it. The table
carries the object until friction carries its weight; where friction is exceeded the object stays
or falls back, and slips along the gel. Units, objects, textures, friction laws, grips and shakes
differ from seed to seed:

    for number in range(20):
        seen = grasp("hex", number)          # or "mini", "mini_marked"; GRIP as a third argument
        seen.reference, seen.frames, seen.truth.slipped, seen.truth.slip_mm[-1]

With ``--out DIR`` the frames are written like the recordings of ``slip/grasp_lift``.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core import load_profile
from tactile_core.quantities import Frame
from tactile_sim import Faults, VirtualStage
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.simulation import write_frame
from tactile_sim.stage import vary

_FOLDER = Path(__file__).resolve().parent / "profiles"
DESIGNS = {
    "hex": "hex_fingertip",
    "mini": str(_FOLDER / "mini_virtual.yaml"),
    "mini_marked": str(_FOLDER / "mini_marked_virtual.yaml"),
}
"""Profiles by short name."""

GRIP_N = {"hex": (2.0, 15.0), "mini": (1.0, 8.0), "mini_marked": (1.0, 8.0)}
"""Range of grip forces; a softer gel is gripped less."""

GROSS = 0.02
"""Stick share of the contact below which slip is gross."""
SOFT_SHARE = 0.15
"""Share of the objects that are soft."""
SLIPPED_MM = 0.5
"""An object that slipped further than this is a slip, any other is held."""


class Protocol(NamedTuple):
    """Timing of a sequence, in frames.

    Attributes
    ----------
    frames : int
    touch : int
        First frame in contact; 0 if the recording starts in contact.
    pressed : int
        First frame at the full grip.
    lift : int
        Last frame before the lift.
    rate_hz : float
    lift_s : float
        Duration of the lift; later frames hold the object in the air.
    """

    frames: int
    touch: int
    pressed: int
    lift: int
    rate_hz: float
    lift_s: float


LIFT = Protocol(frames=21, touch=0, pressed=0, lift=5, rate_hz=30.0, lift_s=0.4)
"""Like the recordings of one fingertip."""
GRIP = Protocol(frames=122, touch=3, pressed=18, lift=50, rate_hz=25.0, lift_s=2.0)
"""Like the recordings of two fingers on a gripper."""


@dataclass(frozen=True)
class Plan:
    """One grasp, drawn at random.

    Attributes
    ----------
    kind, options : str, dict
        The object, for ``VirtualStage.indenter``.
    place_mm, angle_deg : pose of the object
    grip_n : float
        Normal force of the grip.
    gel : dict
        Friction law.
    load : float
        Weight that the finger has to carry, relative to the friction of the grip.
    down_deg : float
        Direction of gravity in the image, from x towards y.
    height_mm : float
        Height of the lift.
    shake : float
        Standard deviation of the vibration's acceleration, relative to gravity.
    by_force : bool
        Whether the gripper holds its force, or its opening.
    loosening : float
        Share of the grip force that is left at the end.
    """

    kind: str
    options: dict[str, Any]
    place_mm: tuple[float, float]
    angle_deg: float
    grip_n: float
    gel: dict[str, Any]
    load: float
    down_deg: float
    height_mm: float
    shake: float
    by_force: bool
    loosening: float


@dataclass(frozen=True, eq=False)
class Truth:
    """Ground truth of one grasp; arrays have one value per frame.

    Attributes
    ----------
    slipped : bool
        Whether the object slipped by more than :data:`SLIPPED_MM`.
    gross_frame : int or None
        First frame in which no more than :data:`GROSS` of the contact sticks. None is possible
        for a slip too: a large contact may creep, with some of it always sticking.
    slip_frame : int or None
        First frame in which the object has slipped by more than :data:`SLIPPED_MM`.
    slip_mm : (T,)
        Distance by which the object moved over the gel since the lift: mean over the contact,
        weighted by the pressure, along gravity.
    travel_mm : (T,)
        Motion of the object relative to the sensor, including the gel's shear.
    stick_share : (T,)
        Sticking share of the contact; 1 without contact.
    shear_n, normal_n : (T,)
        Load on the gel along gravity and normal to it.
    weight_n : float
        Weight that this finger has to carry.
    carried : (T,) bool
        Whether the object is off the table.
    """

    slipped: bool
    gross_frame: int | None
    slip_frame: int | None
    slip_mm: NDArray[np.float64]
    travel_mm: NDArray[np.float64]
    stick_share: NDArray[np.float64]
    shear_n: NDArray[np.float64]
    normal_n: NDArray[np.float64]
    weight_n: float
    carried: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Grasp:
    """Frames of one grasp, the undeformed sensor's frame, and the truth."""

    plan: Plan
    protocol: Protocol
    reference: Frame
    frames: tuple[Frame, ...]
    truth: Truth


class _Moment(NamedTuple):
    """Truth of one frame."""

    slip_mm: float
    travel_mm: float
    stick_share: float
    shear_n: float
    normal_n: float
    carried: bool


def plan(design: str, seed: int) -> Plan:
    """Draw a grasp; a third of the objects are textured, a fifth may reach the image border."""
    rng = np.random.default_rng([seed, sorted(DESIGNS).index(design), 71])
    objects: tuple[tuple[str, dict[str, Any]], ...] = (
        ("sphere", {"diameter_mm": rng.uniform(8, 40)}),
        ("cylinder", {"diameter_mm": rng.uniform(8, 50), "length_mm": rng.uniform(10, 40)}),
        ("cylinder", {"diameter_mm": rng.uniform(8, 50), "length_mm": rng.uniform(3, 10)}),
        ("flat", {"size_mm": (rng.uniform(4, 12), rng.uniform(4, 12))}),
        ("flat", {"diameter_mm": rng.uniform(5, 12)}),
        ("flat", {"size_mm": (60.0, 60.0)}),
    )
    kind, options = objects[int(rng.integers(len(objects)))]
    texture: dict[str, Any] = (
        {"kind": "ribs", "pitch_mm": rng.uniform(0.8, 3), "angle_deg": rng.uniform(0, 180)},
        {"kind": "rough", "grain_mm": rng.uniform(0.4, 1.5), "seed": seed},
        {"kind": "weave", "pitch_mm": rng.uniform(0.6, 1.5)},
    )[int(rng.integers(3))]
    texture["relief_mm"] = rng.uniform(0.02, 0.12) * (0.4 if texture["kind"] == "rough" else 1.0)
    if rng.random() < 1 / 3:
        options["texture"] = texture
    reach_mm = 6.0 if rng.random() < 0.2 else 2.0
    friction = rng.uniform(0.3, 1.2)
    law = int(rng.integers(3))
    drawn = Plan(
        kind,
        options,
        (rng.uniform(-reach_mm, reach_mm), rng.uniform(-reach_mm, reach_mm) * 0.7),
        rng.uniform(0, 180),
        float(np.exp(rng.uniform(*np.log(GRIP_N[design])))),
        {
            "friction": friction,
            "kinetic_friction": friction * rng.uniform(0.3, 0.9) if law == 1 else None,
            "friction_speed_mm_s": rng.uniform(20, 100) if law == 2 else None,
        },
        load=float(np.exp(rng.uniform(np.log(0.25), np.log(2.5)))),
        down_deg=rng.uniform(0, 360),
        height_mm=rng.uniform(2, 8),
        shake=rng.uniform(0, 0.1),
        by_force=bool(rng.random() < 0.5),
        loosening=rng.uniform(0.3, 0.9) if rng.random() < 0.25 else 1.0,
    )
    if rng.random() < SOFT_SHARE:
        options["soft"] = {
            "shear_modulus_mpa": float(np.exp(rng.uniform(np.log(0.03), np.log(1.0)))),
            "thickness_mm": rng.uniform(1, 5),
        }
    return drawn


def grasp(design: str, seed: int, protocol: Protocol = LIFT) -> Grasp:
    """Simulate one grasp on one unit of a design; the same seed gives the same grasp."""
    drawn = plan(design, seed)
    unit = load_profile(DESIGNS[design], sim=True)
    unit = vary(unit, seed)
    unit = unit.model_copy(update={"gel": unit.gel.model_copy(update=drawn.gel)})
    rng = np.random.default_rng([seed, 72])
    faults = Faults(drift=rng.uniform(0, 0.02), dust=int(rng.integers(4)))
    stage = VirtualStage(unit, seed, faults=faults)
    reference = stage.frame()
    frames, moments = [], []
    for moment in _moments(stage, drawn, protocol, rng):
        moments.append(moment)
        frames.append(stage.frame())
    return Grasp(drawn, protocol, reference, tuple(frames), _truth(drawn, protocol, moments))


def _moments(
    stage: GelSurface, drawn: Plan, protocol: Protocol, rng: np.random.Generator
) -> Iterator[_Moment]:
    """Play the grasp: press, hold, lift, hold in the air."""
    down = np.radians(drawn.down_deg)
    gravity = np.array([np.cos(down), np.sin(down)])
    x_mm, y_mm = drawn.place_mm
    step_s = 1 / protocol.rate_hz
    lift_frames = protocol.lift_s * protocol.rate_hz
    made = make_indenter(drawn.kind, **drawn.options)
    stage.indent_with(made, x_mm=x_mm, y_mm=y_mm, angle_deg=drawn.angle_deg)
    slip_mm = travel_mm = weight_n = grip_n = 0.0
    for number in range(protocol.frames):
        lifted = number > protocol.lift
        if number <= protocol.pressed:
            share = (number - protocol.touch + 1) / (protocol.pressed - protocol.touch + 1)
            if share > 0:
                stage.press(force_n=share * drawn.grip_n, steps=2, seconds=step_s)
            if number == protocol.pressed and not drawn.by_force:
                stage.press(depth_mm=stage.depth_mm, steps=1, seconds=0.0)
        elif not lifted:
            stage.hold(step_s)
        if number == protocol.lift:
            grip_n = stage.force_n
            weight_n = _weight_n(drawn, grip_n)
        height_mm = drawn.height_mm * min(max(number - protocol.lift, 0) / lift_frames, 1.0)
        carried = False
        if lifted:
            if drawn.loosening < 1:
                left = (number - protocol.lift) / (protocol.frames - 1 - protocol.lift)
                force_n = grip_n * (1 + (drawn.loosening - 1) * left)
                stage.press(force_n=force_n, steps=1, seconds=0.0)
                slip_mm += _slip_mm(stage, gravity)
            load_n = weight_n * max(1 + drawn.shake * rng.standard_normal(), 0.1)
            stage.pull(
                *(load_n * gravity), at_most_mm=max(height_mm - travel_mm, 0.0), seconds=step_s
            )
            slip_mm += _slip_mm(stage, gravity)
            pose = stage.state.pose
            travel_mm = float((np.array([pose.x_mm, pose.y_mm]) - [x_mm, y_mm]) @ gravity)
            carried = travel_mm < height_mm - 1e-6
        yield _moment(stage, gravity, slip_mm, travel_mm, carried=carried)


def _slip_mm(stage: GelSurface, gravity: NDArray[np.float64]) -> float:
    """Mean slip of the last step along gravity, weighted by the pressure."""
    pressure = stage.state.pressure_mpa
    along = np.tensordot(gravity, stage.state.grip.slip_mm, 1)
    return float((along * pressure).sum() / max(float(pressure.sum()), 1e-12))


def _moment(
    stage: GelSurface,
    gravity: NDArray[np.float64],
    slip_mm: float,
    travel_mm: float,
    *,
    carried: bool,
) -> _Moment:
    touched = int(stage.state.contact.sum())
    share = float(stage.state.stick.sum()) / touched if touched else 1.0
    wrench = stage.wrench
    shear_n = float(wrench[:2] @ gravity)
    return _Moment(slip_mm, travel_mm, share, shear_n, float(wrench[2]), carried)


def _weight_n(drawn: Plan, grip_n: float) -> float:
    return float(drawn.load * drawn.gel["friction"] * grip_n)


def _truth(drawn: Plan, protocol: Protocol, moments: list[_Moment]) -> Truth:
    columns = {name: np.array([getattr(m, name) for m in moments]) for name in moments[0]._fields}
    gross = np.flatnonzero(columns["stick_share"] < GROSS)
    far = np.flatnonzero(columns["slip_mm"] > SLIPPED_MM)
    return Truth(
        slipped=bool(columns["slip_mm"][-1] > SLIPPED_MM),
        gross_frame=int(gross[0]) if len(gross) else None,
        slip_frame=int(far[0]) if len(far) else None,
        weight_n=_weight_n(drawn, moments[protocol.lift].normal_n),
        **columns,
    )


def main() -> None:
    """Print the truth of some grasps, and write their frames if a folder is given."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--design", choices=DESIGNS, default="hex")
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 20), metavar=("FIRST", "END"))
    parser.add_argument("--protocol", choices=("lift", "grip"), default="lift")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    protocol = LIFT if given.protocol == "lift" else GRIP
    rows = []
    for seed in range(*given.seeds):
        seen = grasp(given.design, seed, protocol)
        truth = seen.truth
        print(
            f"{seed:4d} {seen.plan.kind:9s} {'slipped' if truth.slipped else 'held':8s}"
            f"gross from {truth.gross_frame!s:5s} slip {truth.slip_mm[-1]:6.3f} mm, travel "
            f"{truth.travel_mm[-1]:6.3f} mm, weight {truth.weight_n:5.2f} N, grip "
            f"{truth.normal_n[protocol.lift]:5.2f} N"
        )
        if given.out is None:
            continue
        folder = given.out / f"{seed:04d}"
        write_frame(folder / "reference", seen.reference, "undeformed")
        for number, frame in enumerate(seen.frames):
            write_frame(folder / "frames", frame, f"{number:06d}")
        np.savez(folder / "truth.npz", **{k: v for k, v in vars(truth).items() if v is not None})
        rows.append((f"{seed:04d}", int(not truth.slipped), truth.gross_frame, truth.slip_mm[-1]))
    if given.out is not None:
        with (given.out / "labels.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(("trial", "label_stable1_slip0", "gross_frame", "slip_mm"))
            writer.writerows(rows)


if __name__ == "__main__":
    main()
