"""One step of a rigid object in contact with the gel: from one state of the skin to the next."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array
from tactile_core.sim.contact_state import Move, Pose, SurfaceState
from tactile_core.sim.elastic_layer import ElasticLayer
from tactile_core.sim.friction import Grip, solve_friction
from tactile_core.sim.gel import SoftGel
from tactile_core.sim.indenters.shape import Indenter
from tactile_core.sim.normal_contact import solve_normal
from tactile_core.sim.viscoelasticity import TimeStep
from tactile_core.sim.window import Window

_OUT_OF_REACH_MM = -50.0
_FAR_SPACINGS, _FAR_SWEEPS = 0.3, 2
"""After a long way, where the skin has gone must be known before what presses on it is."""
_SLACK = 0.05
"""Share of the depth by which skin may bulge towards the object that presses beside it."""
_HALVINGS = 30


@dataclass(frozen=True)
class Precision:
    """How carefully a step is solved.

    Attributes
    ----------
    normal, friction : float
        Tolerances of :func:`solve_normal` and :func:`solve_friction`.
    sweeps : int
        How often pressure and friction, each of which moves the skin for the other, take turns.
    """

    normal: float
    friction: float
    sweeps: int


@dataclass(frozen=True)
class _Sought:
    """What a step is solved for, on all nodes."""

    move: Move
    time: TimeStep
    left_mm: Array
    carried: Array
    lowered_mm: float
    overlap_mm: Array


@dataclass(frozen=True)
class _Solved:
    """Loads on all nodes, and how much further than asked the object was lowered."""

    pressure: Array
    grip: Grip
    approach_mm: float
    iterations: tuple[int, int]


class ContactModel:
    """A gel on a grid, and how it answers an object.

    Parameters
    ----------
    layer : ElasticLayer
    gel : SoftGel
    precision : Precision
    """

    def __init__(self, layer: ElasticLayer, gel: SoftGel, precision: Precision) -> None:
        self.layer, self.gel, self.precision = layer, gel, precision
        self._nodes = layer.grid.nodes_mm
        self._rest = gel.rest_on(layer.grid)

    def at_rest(self) -> SurfaceState:
        """Return the untouched skin."""
        shape, dtype = self.layer.grid.shape, self.layer.dtype
        return SurfaceState(
            np.zeros((3, *shape), dtype),
            np.zeros(shape, dtype),
            np.zeros((2, *shape), dtype),
            Grip.none(shape, dtype),
            np.zeros((len(self.gel.branches), 3, *shape), dtype),
        )

    def placed(self, state: SurfaceState, indenter: Indenter, pose: Pose) -> SurfaceState:
        """Return the state with the object lowered over the skin until it would first touch it."""
        clearance = self._rest - indenter.gap_mm(*pose.into(*self._nodes))
        row, column = np.unravel_index(np.argmax(clearance), clearance.shape)
        # the highest point lies between the nodes: look again, ten times as closely
        near = np.linspace(-1, 1, 21) * self.layer.grid.spacing_mm
        x, y = np.meshgrid(self._nodes[0, row, column] + near, self._nodes[1, row, column] + near)
        closer = self.gel.rest_mm(x, y) - indenter.gap_mm(*pose.into(x, y))
        level = max(float(clearance[row, column]), float(closer.max()))
        return replace(state, level_mm=level, pose=pose, depth_mm=0.0)

    def step(self, state: SurfaceState, indenter: Indenter, move: Move) -> SurfaceState:
        """Return the skin after the object has moved.

        Pressure and friction are solved in a window around the contact, which is made wider if it
        turns out to be too small; where they move the rest of the skin is told in the end.
        """
        layer, dtype = self.layer, self.layer.dtype
        time = TimeStep(self.gel.branches, move.seconds)
        before = state.displacement_mm
        left = time.remembered(before, state.stretches_mm)
        was = self._nodes + before[:2]
        carried = self._carried(state, indenter, move, was)
        depth = 0.0 if move.depth_mm is None else move.depth_mm
        lowered = depth - state.level_mm
        start = was + carried * state.stick
        overlap = self._overlap(indenter, move.pose, start, lowered) - left[2]
        sought = _Sought(move, time, left, carried, lowered, overlap)
        pressure, approach = self._first_guess(state, sought)
        window = Window.around(_within_reach(overlap, approach) | (pressure > 0))
        while True:
            solved = self._solved(window, state, indenter, sought, pressure)
            near = _within_reach(overlap, solved.approach_mm) | (solved.pressure > 0)
            if window.holds(near) and not window.reaches_its_border(solved.pressure > 0):
                break
            window = Window.around(
                near | window.spread_out(np.ones(window.shape, np.bool_), layer.shape)
            )
            pressure = solved.pressure
        displacement = layer.displacement(solved.grip.traction, solved.pressure)
        displacement = (displacement / time.stiffening + left).astype(dtype, copy=False)
        anchors = np.where(
            solved.pressure > 0,
            state.anchors_mm + carried - solved.grip.slip_mm,
            displacement[:2],
        ).astype(dtype, copy=False)
        return SurfaceState(
            displacement,
            solved.pressure,
            anchors,
            solved.grip,
            time.stretched(state.stretches_mm, displacement - before),
            state.level_mm,
            move.pose,
            depth + solved.approach_mm,
            solved.iterations,
        )

    def _solved(
        self,
        window: Window,
        state: SurfaceState,
        indenter: Indenter,
        sought: _Sought,
        pressure: Array,
    ) -> _Solved:
        """Solve pressure and friction in turns, of which the first starts from this pressure."""
        layer, move, stiffening = self.layer, sought.move, sought.time.stiffening
        near = layer.near(window.shape)
        total = None if move.force_n is None else move.force_n / layer.grid.cell_mm2
        nodes, carried, left = (window.of(a) for a in (self._nodes, sought.carried, sought.left_mm))
        anchors = window.of(state.anchors_mm)
        overlap, pressure = window.of(sought.overlap_mm), window.of(pressure)
        grip = Grip(window.of(state.grip.traction), window.of(state.grip.slip_mm))
        far = np.abs(carried * (pressure > 0)).max() > _FAR_SPACINGS * layer.grid.spacing_mm
        counted = np.zeros(2, int)
        for sweep in range(sweeps := max(self.precision.sweeps, _FAR_SWEEPS if far else 1)):
            normal = solve_normal(
                near.indentation,
                overlap * stiffening - near.bulge(grip.traction),
                pressure,
                total_mpa=total,
                tolerance=self.precision.normal,
            )
            pressure = normal.pressure
            spread = near.spread(pressure) / stiffening + left[:2]
            grip = solve_friction(
                near,
                anchors + carried * (pressure > 0) - spread,
                self.gel.friction * pressure,
                grip,
                stiffening=stiffening,
                free_slip_mm=(self.gel.friction_speed_mm_s or 0.0) * move.seconds
                if self.gel.friction_speed_mm_s and np.isfinite(move.seconds)
                else 0.0,
                tolerance=self.precision.friction,
            )
            counted += np.array([normal.iterations, grip.iterations])
            if sweep + 1 < sweeps:
                now = nodes + near.shift(grip.traction) / stiffening + spread
                overlap = self._overlap(indenter, move.pose, now, sought.lowered_mm, window)
                overlap = overlap - left[2]
        shape = layer.shape
        return _Solved(
            window.spread_out(pressure, shape),
            Grip(
                window.spread_out(grip.traction, shape),
                window.spread_out(grip.slip_mm, shape),
                grip.resolution_mm,
                grip.iterations,
            ),
            normal.approach_mm / stiffening,
            (int(counted[0]), int(counted[1])),
        )

    def _overlap(
        self,
        indenter: Indenter,
        pose: Pose,
        now_mm: Array,
        lowered_mm: float,
        window: Window | None = None,
    ) -> Array:
        """How far the object would reach into the skin that no pressure has moved."""
        rest = self._rest if window is None else window.of(self._rest)
        overlap = rest - indenter.gap_mm(*pose.into(*now_mm))
        overlap += lowered_mm
        return np.asarray(np.maximum(overlap, _OUT_OF_REACH_MM), self.layer.dtype)

    def _first_guess(self, state: SurfaceState, sought: _Sought) -> tuple[Array, float]:
        """Pressure to start from, and by how much the object will have to be lowered."""
        if sought.move.force_n is None:
            return state.pressure_mpa, 0.0
        if state.pressure_mpa.any():
            return state.pressure_mpa, state.depth_mm
        # as if every node stood on a spring by itself, and a soft one: the contact is smaller
        springs = self.layer.softest / sought.time.stiffening
        volume = springs * sought.move.force_n / self.layer.grid.cell_mm2
        low, high = 0.0, volume - float(sought.overlap_mm.max())
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            enough = np.maximum(sought.overlap_mm + middle, 0).sum(dtype=float) > volume
            low, high = (low, middle) if enough else (middle, high)
        return np.maximum(sought.overlap_mm + high, 0) / springs, high

    def released(self, state: SurfaceState, seconds: float) -> SurfaceState:
        """Return the skin some time after the object was taken away."""
        time = TimeStep(self.gel.branches, seconds)
        left = time.remembered(state.displacement_mm, state.stretches_mm)
        stretches = time.stretched(state.stretches_mm, left - state.displacement_mm)
        rest = self.at_rest()
        return replace(rest, displacement_mm=left, anchors_mm=left[:2], stretches_mm=stretches)

    def _carried(self, state: SurfaceState, indenter: Indenter, move: Move, was_mm: Array) -> Array:
        """(2, ny, nx) how the object's surface moves along the skin."""
        if move.rolls:
            # it turns about its lowest point, and what lies higher lags behind
            radius = indenter.rolling_radius_mm
            assert radius is not None
            rise = np.minimum(indenter.gap_mm(*state.pose.into(*was_mm)) / radius, 1)
            dx, dy = move.pose.x_mm - state.pose.x_mm, move.pose.y_mm - state.pose.y_mm
            return np.stack([dx * rise, dy * rise]).astype(self.layer.dtype)
        if move.pose.angle_deg == state.pose.angle_deg:
            carried = np.empty_like(was_mm, self.layer.dtype)
            carried[0] = move.pose.x_mm - state.pose.x_mm
            carried[1] = move.pose.y_mm - state.pose.y_mm
            return carried
        x, y = move.pose.back(*state.pose.into(*was_mm))
        return (np.stack([x, y]) - was_mm).astype(self.layer.dtype)


def _within_reach(overlap_mm: Array, approach_mm: float) -> NDArray[np.bool_]:
    """Nodes that may be touched; the nearest one at least."""
    deepest = float(overlap_mm.max()) + approach_mm
    least = -_SLACK * deepest if deepest > 0 else deepest
    return np.asarray(overlap_mm >= least - approach_mm)
