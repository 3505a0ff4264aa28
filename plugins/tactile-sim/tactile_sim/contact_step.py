"""One quasi-static or timed step of a rigid object in contact with the gel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.force.elastic_layer import ElasticLayer
from tactile_core.algorithms.force.response import Response
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid, TimeStep
from tactile_sim.contact_state import Move, Pose, SurfaceState
from tactile_sim.friction import Grip, solve_friction
from tactile_sim.gel import SoftGel
from tactile_sim.indenters.solids import Indenter
from tactile_sim.normal_contact import Window, solve_normal

OUT_OF_REACH_MM = -50.0  # Overlap of nodes below no part of the object; it exceeds any press


@dataclass(frozen=True)
class Precision:
    """Solver tolerances of a step.

    Attributes
    ----------
    normal, friction : float
        Tolerances of :func:`solve_normal` and :func:`solve_friction`.
    sweeps : int
        Number of alternations between pressure and friction, which displace the gel surface for
        each other.
    """

    normal: float
    friction: float
    sweeps: int


@dataclass(frozen=True)
class _StepProblem:
    """Inputs of the contact problem of one step, on all nodes.

    ``residual_mm`` is the displacement that viscoelasticity leaves without load, and ``motion``
    the tangential motion of the object's surface.
    """

    move: Move
    time: TimeStep
    residual_mm: Array
    motion: Array
    lowered_mm: float
    overlap_mm: Array


@dataclass(frozen=True)
class _StepSolution:
    """Loads on all nodes, and the depth added to reach the requested force."""

    pressure: Array
    grip: Grip
    approach_mm: float
    iterations: tuple[int, int]


class ContactModel:
    """Contact mechanics of a gel on a grid.

    Parameters
    ----------
    layer : ElasticLayer
    gel : SoftGel
    precision : Precision

    References
    ----------
    .. [1] Polonsky, Keer, "A numerical method for solving rough contact problems based on the
       multi-level multi-summation and conjugate gradient techniques", Wear 231, 1999.
    .. [2] Boyd, Parikh, Chu, Peleato, Eckstein, "Distributed Optimization and Statistical Learning
       via the Alternating Direction Method of Multipliers", Foundations and Trends in Machine
       Learning 3, 2011.
    """

    def __init__(self, layer: ElasticLayer, gel: SoftGel, precision: Precision) -> None:
        self.layer, self.gel, self.precision = layer, gel, precision
        self._nodes = layer.grid.nodes_mm
        self._rest = gel.rest_on(layer.grid)
        self._finer: tuple[int, ElasticLayer] | None = None

    def finer(self, factor: int) -> ElasticLayer:
        """Return the layer on a grid of ``factor`` times as many nodes along each side."""
        if self._finer is None or self._finer[0] != factor:
            grid = self.layer.grid
            fine = SurfaceGrid(factor * grid.nx, factor * grid.ny, grid.spacing_mm / factor)
            self._finer = factor, ElasticLayer(fine, self.layer.elastomer, self.layer.dtype)
        return self._finer[1]

    def undeformed_state(self) -> SurfaceState:
        """Return the state of the undeformed gel surface."""
        shape, dtype = self.layer.grid.shape, self.layer.dtype
        return SurfaceState(
            np.zeros((3, *shape), dtype),
            np.zeros(shape, dtype),
            np.zeros((2, *shape), dtype),
            Grip.none(shape, dtype),
            np.zeros((len(self.gel.branches), 3, *shape), dtype),
        )

    def place_object(self, state: SurfaceState, indenter: Indenter, pose: Pose) -> SurfaceState:
        """Return the state with the object lowered to first contact."""
        clearance = self._rest - indenter.gap_mm(*pose.to_object_frame(*self._nodes))
        row, column = np.unravel_index(np.argmax(clearance), clearance.shape)
        # the highest point is between nodes: search again on a ten times finer grid
        near = np.linspace(-1, 1, 21) * self.layer.grid.spacing_mm
        x, y = np.meshgrid(self._nodes[0, row, column] + near, self._nodes[1, row, column] + near)
        closer = self.gel.rest_mm(x, y) - indenter.gap_mm(*pose.to_object_frame(x, y))
        level = max(float(clearance[row, column]), float(closer.max()))
        return replace(state, level_mm=level, pose=pose, depth_mm=0.0)

    def step(self, state: SurfaceState, indenter: Indenter, move: Move) -> SurfaceState:
        """Return the gel surface after the object has moved.

        Pressure and friction are solved in a window around the contact, which is enlarged if it
        proves too small. The displacement of the whole surface is computed once, at the end.
        """
        layer, dtype = self.layer, self.layer.dtype
        time = TimeStep(self.gel.branches, move.seconds)
        before = state.displacement_mm
        residual = time.residual_displacement(before, state.stretches_mm)
        positions = self._nodes + before[:2]
        motion = self._object_motion(state, indenter, move, positions)
        depth = 0.0 if move.depth_mm is None else move.depth_mm
        lowered = depth - state.level_mm
        start = positions + motion * state.stick
        overlap = self._overlap(indenter, move.pose, start, lowered) - residual[2]
        problem = _StepProblem(move, time, residual, motion, lowered, overlap)
        pressure, approach = self._first_guess(state, problem)
        window = Window.around(_within_reach(overlap, approach) | (pressure > 0))
        while True:
            solved = self._solve_contact(window, state, indenter, problem, pressure)
            near = _within_reach(overlap, solved.approach_mm) | (solved.pressure > 0)
            if window.contains(near) and not window.reaches_its_border(solved.pressure > 0):
                break
            window = Window.around(
                near | window.embed_part(np.ones(window.shape, np.bool_), layer.shape)
            )
            pressure = solved.pressure
        displacement = layer.displacement(solved.grip.traction, solved.pressure)
        displacement = (displacement / time.stiffening + residual).astype(dtype, copy=False)
        carried = state.anchors_mm + motion - solved.grip.slip_mm
        anchors = np.where(solved.pressure > 0, carried, displacement[:2])
        return SurfaceState(
            displacement,
            solved.pressure,
            anchors.astype(dtype, copy=False),
            solved.grip,
            time.advance_stretches(state.stretches_mm, displacement - before),
            state.level_mm,
            move.pose,
            depth + solved.approach_mm,
            solved.iterations,
        )

    def _solve_contact(
        self,
        window: Window,
        state: SurfaceState,
        indenter: Indenter,
        problem: _StepProblem,
        pressure: Array,
    ) -> _StepSolution:
        """Alternate between pressure and friction, starting from this pressure."""
        layer, move, stiffening = self.layer, problem.move, problem.time.stiffening
        near = layer.near(window.shape)
        total = None if move.force_n is None else move.force_n / layer.grid.cell_mm2
        nodes, motion, residual = (
            window.view_of(a) for a in (self._nodes, problem.motion, problem.residual_mm)
        )
        anchors = window.view_of(state.anchors_mm)
        overlap, pressure = window.view_of(problem.overlap_mm), window.view_of(pressure)
        grip = Grip(window.view_of(state.grip.traction), window.view_of(state.grip.slip_mm))
        slips = window.view_of(state.contact & ~state.stick)
        longest_mm = np.abs(motion * (pressure > 0)).max()
        # the gel surface moves before the pressure on it is known (ADR 21)
        far = longest_mm > 0.3 * layer.grid.spacing_mm
        iterations = np.zeros(2, int)
        sweeps = max(self.precision.sweeps, 2 if far else 1)
        for sweep in range(sweeps):
            normal = solve_normal(
                near.indentation,
                overlap * stiffening - near.bulge(grip.traction),
                pressure,
                total_mpa=total,
                tolerance=self.precision.normal,
            )
            pressure = normal.pressure
            spread = near.spread(pressure) / stiffening + residual[:2]
            wanted = anchors + motion * (pressure > 0) - spread
            grip = self._solve_grip(near, wanted, pressure, slips, grip, problem.time)
            iterations += np.array([normal.iterations, grip.iterations])
            if sweep + 1 < sweeps:
                now = nodes + near.shift(grip.traction) / stiffening + spread
                overlap = self._overlap(indenter, move.pose, now, problem.lowered_mm, window)
                overlap = overlap - residual[2]
        shape = layer.shape
        return _StepSolution(
            window.embed_part(pressure, shape),
            Grip(
                window.embed_part(grip.traction, shape),
                window.embed_part(grip.slip_mm, shape),
                grip.resolution_mm,
                grip.iterations,
            ),
            normal.approach_mm / stiffening,
            (int(iterations[0]), int(iterations[1])),
        )

    def _solve_grip(
        self,
        near: Response,
        wanted_mm: Array,
        pressure: Array,
        slips: NDArray[np.bool_],
        start: Grip,
        time: TimeStep,
    ) -> Grip:
        """Solve for friction; nodes that slip in the last step or in this one have the kinetic."""
        gel = self.gel
        free_slip_mm = 0.0
        if gel.friction_speed_mm_s and np.isfinite(time.seconds):
            free_slip_mm = gel.friction_speed_mm_s * time.seconds
        kinetic = gel.friction if gel.kinetic_friction is None else gel.kinetic_friction
        grip = start
        for _ in range(9):  # nodes that slip lose static friction and pass load to the others
            grip = solve_friction(
                near,
                wanted_mm,
                np.where(slips, kinetic, gel.friction).astype(pressure.dtype) * pressure,
                grip,
                stiffening=time.stiffening,
                free_slip_mm=free_slip_mm,
                tolerance=self.precision.friction,
            )
            if kinetic == gel.friction:
                return grip
            more = slips | (np.hypot(*grip.slip_mm) > grip.resolution_mm)
            if not (more & ~slips & (pressure > 0)).any():
                return grip
            slips = more
        return grip

    def _overlap(
        self,
        indenter: Indenter,
        pose: Pose,
        now_mm: Array,
        lowered_mm: float,
        window: Window | None = None,
    ) -> Array:
        """Overlap of the object with the gel surface before pressure deforms it, mm."""
        rest = self._rest if window is None else window.view_of(self._rest)
        overlap = rest - indenter.gap_mm(*pose.to_object_frame(*now_mm))
        overlap += lowered_mm
        return np.asarray(np.maximum(overlap, OUT_OF_REACH_MM), self.layer.dtype)

    def _first_guess(self, state: SurfaceState, problem: _StepProblem) -> tuple[Array, float]:
        """Initial pressure, and the depth by which the object must probably be lowered."""
        if problem.move.force_n is None:
            return state.pressure_mpa, 0.0
        if state.pressure_mpa.any():
            return state.pressure_mpa, state.depth_mm
        # a Winkler foundation with the layer's largest compliance: the real contact is smaller
        springs = self.layer.softest / problem.time.stiffening
        volume = springs * problem.move.force_n / self.layer.grid.cell_mm2
        low, high = 0.0, volume - float(problem.overlap_mm.max())
        for _ in range(30):  # beyond the precision of float32
            middle = (low + high) / 2
            enough = np.maximum(problem.overlap_mm + middle, 0).sum(dtype=float) > volume
            low, high = (low, middle) if enough else (middle, high)
        return np.maximum(problem.overlap_mm + high, 0) / springs, high

    def release_object(self, state: SurfaceState, seconds: float) -> SurfaceState:
        """Return the gel surface some time after the object was removed."""
        time = TimeStep(self.gel.branches, seconds)
        residual = time.residual_displacement(state.displacement_mm, state.stretches_mm)
        stretches = time.advance_stretches(state.stretches_mm, residual - state.displacement_mm)
        return replace(
            self.undeformed_state(),
            displacement_mm=residual,
            anchors_mm=residual[:2],
            stretches_mm=stretches,
        )

    def _object_motion(
        self, state: SurfaceState, indenter: Indenter, move: Move, positions_mm: Array
    ) -> Array:
        """(2, ny, nx) tangential motion of the object's surface at each node, mm."""
        if move.rolls:
            # the object rotates about its lowest point: its surface moves by dx · rise / radius
            radius = indenter.rolling_radius_mm
            assert radius is not None
            rise = np.minimum(
                indenter.gap_mm(*state.pose.to_object_frame(*positions_mm)) / radius, 1
            )
            dx, dy = move.pose.x_mm - state.pose.x_mm, move.pose.y_mm - state.pose.y_mm
            return np.stack([dx * rise, dy * rise]).astype(self.layer.dtype)
        if move.pose.angle_deg == state.pose.angle_deg:
            motion = np.empty_like(positions_mm, self.layer.dtype)
            motion[0] = move.pose.x_mm - state.pose.x_mm
            motion[1] = move.pose.y_mm - state.pose.y_mm
            return motion
        x, y = move.pose.back(*state.pose.to_object_frame(*positions_mm))
        return (np.stack([x, y]) - positions_mm).astype(self.layer.dtype)


def _within_reach(overlap_mm: Array, approach_mm: float) -> NDArray[np.bool_]:
    """Nodes that may come into contact; at least the nearest one."""
    deepest = float(overlap_mm.max()) + approach_mm
    # the gel surface bulges beside the contact; a window that is too small is enlarged
    least = -0.05 * deepest if deepest > 0 else deepest
    return np.asarray(overlap_mm >= least - approach_mm)
