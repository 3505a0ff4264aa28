"""Mechanics of a virtual sensor: press, shear, twist and roll an object on its gel surface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.force.elastic_layer import ElasticLayer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_sim.contact_state import Move, Pose, SurfaceState
from tactile_sim.contact_step import ContactModel
from tactile_sim.deformed_surface import DeformedSurface
from tactile_sim.gel import SoftGel
from tactile_sim.indenters import Indenter
from tactile_sim.modes import MODES, Mode
from tactile_sim.motion import checked_seconds, checked_steps, slowing_steps, straight_path
from tactile_sim.normal_contact import balance_load
from tactile_sim.refinement import accurate_spacing
from tactile_sim.resampling import ImageSampler


class GelSurface(DeformedSurface):
    """The gel surface of a profile, deformed by an object.

    Deterministic, picklable and independent of any device. Increments are quasi-static (all
    stress relaxes) unless they are given seconds.

    Parameters
    ----------
    profile : SensorBuild
        Provides the gel, and the size and scale of the image.
    mode : "accurate" or "fast"
        "accurate" puts at least ten nodes on the radius of a contact, up to 1280 across the gel;
        it chooses the grid at the first contact after a reset. "fast" runs at camera rate.

    Attributes
    ----------
    markers_px : (N, 2) float64
        Centres of the printed markers on the undeformed surface; empty unless set.
    time_s : float
        Simulated time; it advances only in moves that are given seconds.
    """

    def __init__(self, profile: SensorBuild, mode: Mode = "accurate") -> None:
        if mode not in MODES:
            raise InputError(f"mode should be 'accurate' or 'fast', not {mode!r}")
        image = profile.image
        self.mode: Mode = mode
        self.gel = SoftGel.from_gel(profile.gel)
        self.image_shape = image.height_px, image.width_px
        self.mm_per_px = image.mm_per_px
        self._extent = self.gel.extent_mm(
            (image.width_px * image.mm_per_px, image.height_px * image.mm_per_px)
        )
        self._indenter: Indenter | None = None
        self._pose = Pose()
        self.markers_px: NDArray[np.float64] = np.zeros((0, 2))
        self._build(max(self._extent) / MODES[mode].nodes_across)
        self.reset()

    @property
    def pressed(self) -> bool:
        """Whether an object is in contact with the gel surface."""
        return self._on

    @property
    def depth_mm(self) -> float:
        """Depth of the object below first contact, mm; 0 if nothing is pressed."""
        return float(self._state.depth_mm) if self._on else 0.0

    def reset(self) -> None:
        """Remove the object and return to the undeformed gel surface."""
        self._state = self._model.undeformed_state()
        # The load that is held constant while the object moves: depth_mm or force_n.
        self._load: dict[str, float] = {}
        self._on, self.time_s = False, 0.0

    def indent_with(
        self, indenter: Indenter, *, x_mm: float = 0.0, y_mm: float = 0.0, angle_deg: float = 0.0
    ) -> None:
        """Select the object for the next press, and place it above the gel surface.

        Parameters
        ----------
        indenter : Indenter
        x_mm, y_mm : float
            Position of the object's origin relative to the image centre.
        angle_deg : float
            Rotation of the object, positive from x towards y.

        Raises
        ------
        InputError
            Another object is still pressed, or the position is not above the gel.
        """
        if self._on:
            raise InputError("an object is still pressed; release it before taking another one")
        width, height = self._extent
        if not (abs(x_mm) <= width / 2 and abs(y_mm) <= height / 2):
            raise InputError(
                f"({x_mm:g}, {y_mm:g}) mm is outside the gel; place the object within "
                f"±{width / 2:.3g} × ±{height / 2:.3g} mm of the image centre"
            )
        self._indenter, self._pose = indenter, Pose(float(x_mm), float(y_mm), float(angle_deg))

    def press(
        self,
        depth_mm: float | None = None,
        force_n: float | None = None,
        *,
        steps: int | None = None,
        seconds: float | None = None,
    ) -> None:
        """Lower or raise the object in equal steps.

        The depth or the force given here stays constant during later moves.

        Parameters
        ----------
        depth_mm : float, optional
            Target depth below first contact.
        force_n : float, optional
            Target normal force, instead of a depth.
        steps : int, optional
            Number of steps. Default: 4 in fast mode, 5 in accurate mode.
        seconds : float, optional
            Duration. Default: quasi-static.

        Raises
        ------
        InputError
            Both or neither of depth and force are given, one is negative, there is no object, it
            would reach the plate behind the gel, or it misses the gel.
        """
        if (depth_mm is None) == (force_n is None):
            raise InputError("press needs either depth_mm or force_n, and not both")
        target = depth_mm if depth_mm is not None else force_n
        assert target is not None
        by_force = force_n is not None
        if not (np.isfinite(target) and (target > 0 if by_force else target >= 0)):
            raise InputError(
                f"force_n should be above 0, not {target:g}; release() removes the object"
                if by_force
                else f"depth_mm should be 0 or more, not {target:g}"
            )
        if not by_force:
            self.gel.check_depth(target)
        count = checked_steps(MODES[self.mode].press_steps if steps is None else steps)
        duration = checked_seconds(seconds)
        with self._undone_on_error():
            if not self._on:
                self._touch(target, by_force=by_force)
            start = self.force_n if by_force else self._state.depth_mm
            for share in np.arange(1, count + 1) / count:
                load = start + share * (target - start)
                self._load = {"force_n" if by_force else "depth_mm": load}
                self._advance(self._state.pose, duration / count)

    def shear(
        self,
        dx_mm: float = 0.0,
        dy_mm: float = 0.0,
        steps: int = 1,
        *,
        seconds: float | None = None,
    ) -> None:
        """Move the object tangentially by (dx, dy) mm in equal steps.

        Raises
        ------
        InputError
            Nothing is pressed, or the number of steps or seconds is invalid.
        """
        self._follow(self._path(dx_mm, dy_mm, 0.0, steps, seconds))

    def twist(self, degrees: float, steps: int = 1, *, seconds: float | None = None) -> None:
        """Rotate the object about its own origin, from x towards y, in equal steps.

        Raises
        ------
        InputError
            Nothing is pressed, or the number of steps or seconds is invalid.
        """
        self._follow(self._path(0.0, 0.0, degrees, steps, seconds))

    def move(
        self,
        dx_mm: float = 0.0,
        dy_mm: float = 0.0,
        degrees: float = 0.0,
        *,
        depth_mm: float | None = None,
        seconds: float | None = None,
    ) -> None:
        """Shift, twist and lower the object at the same time, in one step.

        Parameters
        ----------
        dx_mm, dy_mm, degrees : float
            As of :meth:`shear` and :meth:`twist`.
        depth_mm : float, optional
            New depth below first contact. Default: the load stays.
        seconds : float, optional
            Duration. Default: quasi-static.

        Raises
        ------
        InputError
            Nothing is pressed, or a value is invalid.
        """
        path = self._path(dx_mm, dy_mm, degrees, 1, seconds)
        if depth_mm is not None and not (np.isfinite(depth_mm) and depth_mm >= 0):
            raise InputError(f"depth_mm should be 0 or more, not {depth_mm:g}")
        with self._undone_on_error():
            if depth_mm is not None:
                self.gel.check_depth(depth_mm)
                self._load = {"depth_mm": depth_mm}
            for pose, duration in path:
                self._advance(pose, duration)

    def roll(
        self,
        dx_mm: float = 0.0,
        dy_mm: float = 0.0,
        steps: int = 1,
        *,
        seconds: float | None = None,
    ) -> None:
        """Roll the object by (dx, dy) mm in equal steps.

        Raises
        ------
        InputError
            Nothing is pressed, the object cannot roll in this direction, or the number of steps or
            seconds is invalid.
        """
        path = self._path(dx_mm, dy_mm, 0.0, steps, seconds)
        assert self._indenter is not None
        angle = np.radians(self._state.pose.angle_deg)
        along = dx_mm * np.cos(angle) + dy_mm * np.sin(angle)
        if self._indenter.rolling_radius_mm is None:
            raise InputError("this object cannot roll; a sphere can, and a cylinder")
        if not self._indenter.rolls_along_x and abs(along) > 1e-6 * np.hypot(dx_mm, dy_mm):
            raise InputError("a cylinder rolls across its axis only; turn it, or shear it instead")
        self._follow(path, rolls=True)

    def pull(
        self, fx_n: float, fy_n: float, *, at_most_mm: float, seconds: float | None = None
    ) -> None:
        """Load the object tangentially, in one step: it moves until the gel holds the load.

        The object moves along the load, and back if the load has decreased. Where friction cannot
        hold the load it moves by ``at_most_mm``, for example down to the table below it.

        Parameters
        ----------
        fx_n, fy_n : float
            Load on the object, N: its weight, plus its mass times the acceleration of the sensor.
        at_most_mm : float
            Largest motion along the load.
        seconds : float, optional
            Duration. Default: quasi-static.

        Raises
        ------
        InputError
            Nothing is pressed, the load is zero, or a value is not finite or negative.
        """
        load_n = float(np.hypot(fx_n, fy_n))
        if not (np.isfinite(load_n) and load_n > 0):
            raise InputError(f"a load should be above 0 and finite, not ({fx_n:g}, {fy_n:g}) N")
        if not (np.isfinite(at_most_mm) and at_most_mm >= 0):
            raise InputError(f"at_most_mm should be 0 or more, not {at_most_mm:g}")
        along, down = fx_n / load_n, fy_n / load_n
        duration = checked_seconds(seconds)

        def pose(travel_mm: float) -> Pose:
            ((end, _),) = self._path(travel_mm * along, travel_mm * down, 0.0, 1, seconds)
            return end

        def force_n(travel_mm: float) -> float:
            traction = self._step_to_pose(pose(travel_mm), duration).grip.traction
            fx, fy = traction.sum((1, 2), dtype=np.float64) * self.grid.cell_mm2
            return float(fx * along + fy * down)

        # a sticking contact of this area on a layer in simple shear
        area_mm2 = np.count_nonzero(self._state.contact) * self.grid.cell_mm2
        elastomer = self.gel.elastomer
        first_mm = load_n * elastomer.thickness_mm / (elastomer.shear_modulus_mpa * area_mm2)
        with self._undone_on_error():
            travel_mm = balance_load(force_n, load_n, first_mm=first_mm, at_most_mm=at_most_mm)
            self._advance(pose(travel_mm), duration)

    def hold(self, seconds: float) -> None:
        """Let time pass at constant pose, and at constant depth or force.

        Raises
        ------
        InputError
            The duration is negative.
        """
        steps = slowing_steps(checked_seconds(seconds))
        if self._on:
            self._follow([(self._state.pose, duration) for duration in steps])
            return
        for duration in steps:
            self._state = self._model.release_object(self._state, duration)
            self.time_s += duration

    def release(self, seconds: float | None = None) -> None:
        """Remove the object and let the gel surface recover for this time; fully by default."""
        duration = checked_seconds(seconds)
        self._state = self._model.release_object(self._state, duration)
        self._on, self._load = False, {}
        if np.isfinite(duration):
            self.time_s += duration

    def _build(self, spacing_mm: float) -> None:
        grid = SurfaceGrid.covering(*self._extent, spacing_mm)
        layer = ElasticLayer(grid, self.gel.elastomer)
        self._model = ContactModel(layer, self.gel, MODES[self.mode].precision)
        self._sampler = ImageSampler(grid, self.image_shape, self.mm_per_px)

    def _touch(self, target: float, *, by_force: bool) -> None:
        """Lower the object to first contact, on a grid fine enough for the target load."""
        if self._indenter is None:
            raise InputError("there is no object to press; choose an indenter first")
        if self.mode == "accurate" and not self._state.displacement_mm.any() and target > 0:
            move = Move(self._pose, *((None, target) if by_force else (target, None)))
            coarsest = max(self._extent) / MODES["accurate"].nodes_across
            self._build(accurate_spacing(self.gel, self._extent, coarsest, self._indenter, move))
            self._state = self._model.undeformed_state()
        placed = self._model.place_object(self._state, self._indenter, self._pose)
        if placed.level_mm < -2 * max(self._extent):
            raise InputError("the object misses the gel; place it above the gel")
        self._state, self._on = placed, True

    def _path(
        self, dx_mm: float, dy_mm: float, degrees: float, steps: int, seconds: float | None
    ) -> list[tuple[Pose, float]]:
        if not self._on:
            raise InputError("nothing is pressed; press an object before moving it")
        return straight_path(self._state.pose, dx_mm, dy_mm, degrees, steps, seconds)

    def _follow(self, path: Sequence[tuple[Pose, float]], *, rolls: bool = False) -> None:
        with self._undone_on_error():
            for pose, seconds in path:
                self._advance(pose, seconds, rolls=rolls)

    @contextmanager
    def _undone_on_error(self) -> Iterator[None]:
        before = self._state, self._on, self._load, self.time_s, self._model, self._sampler
        try:
            yield
        except InputError:
            self._state, self._on, self._load, self.time_s, self._model, self._sampler = before
            raise

    def _step_to_pose(self, pose: Pose, seconds: float, *, rolls: bool = False) -> SurfaceState:
        assert self._indenter is not None
        move = Move(pose, seconds=seconds, rolls=rolls, **self._load)
        new = self._model.step(self._state, self._indenter, move)
        self.gel.check_depth(new.depth_mm)
        return new

    def _advance(self, pose: Pose, seconds: float, *, rolls: bool = False) -> None:
        self._state = self._step_to_pose(pose, seconds, rolls=rolls)
        if np.isfinite(seconds):
            self.time_s += seconds
