"""The mechanics of a virtual sensor: an object pressed, sheared, turned and rolled on its gel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.sim.contact_state import Move, Pose, SurfaceState
from tactile_core.sim.contact_step import ContactModel, Precision
from tactile_core.sim.elastic_layer import ElasticLayer
from tactile_core.sim.gel import SoftGel
from tactile_core.sim.grid import Grid
from tactile_core.sim.indenters import Indenter
from tactile_core.sim.motion import checked_seconds, checked_steps, slowing_steps, straight_path
from tactile_core.sim.refinement import accurate_spacing
from tactile_core.sim.resampling import ImageSampler
from tactile_core.sim.truth import TrueState

Mode = Literal["accurate", "fast"]

_NODES_ACROSS: dict[Mode, int] = {"fast": 128, "accurate": 256}
_PRECISION: dict[Mode, Precision] = {
    "fast": Precision(normal=2e-3, friction=5e-3, sweeps=1),
    "accurate": Precision(normal=1e-4, friction=1e-3, sweeps=3),
}
_PRESS_STEPS: dict[Mode, int] = {"fast": 4, "accurate": 5}


class GelSurface:
    """The skin of a profile's gel, its state, and what moves it.

    Deterministic, picklable, and without any device. Increments are quasi-static, as slow as it
    takes for all stress to relax, unless they are given seconds.

    Parameters
    ----------
    profile : SensorBuild
        Its gel and the size and scale of its image are used.
    mode : "accurate" or "fast"
        Accurate puts ten nodes or more on the radius of a contact, as far as 1280 across the gel
        allow; the nodes are chosen at the first touch after a rest. Fast keeps up with a camera.

    Attributes
    ----------
    markers_px : (N, 2) float64
        Centres of the markers that are printed on it, at rest; none unless they are set.
    time_s : float
        Simulated time; it passes only where a move is given seconds.
    """

    def __init__(self, profile: SensorBuild, mode: Mode = "accurate") -> None:
        if mode not in _NODES_ACROSS:
            raise InputError(f"mode should be 'accurate' or 'fast', not {mode!r}")
        image = profile.image
        self.mode: Mode = mode
        self.gel = SoftGel.of(profile.gel)
        self.image_shape = image.height_px, image.width_px
        self.mm_per_px = image.mm_per_px
        self._extent = self.gel.extent_mm(
            (image.width_px * image.mm_per_px, image.height_px * image.mm_per_px)
        )
        self._indenter: Indenter | None = None
        self._pose = Pose()
        self.markers_px: NDArray[np.float64] = np.zeros((0, 2))
        self._build(max(self._extent) / _NODES_ACROSS[mode])
        self.reset()

    @property
    def state(self) -> SurfaceState:
        """Everything on the nodes."""
        return self._state

    @property
    def grid(self) -> Grid:
        """The nodes."""
        return self._model.layer.grid

    @property
    def pressed(self) -> bool:
        """Whether an object is on the skin."""
        return self._on

    @property
    def depth_mm(self) -> float:
        """How far beyond the first touch the object is lowered; 0 where none is pressed."""
        return float(self._state.depth_mm) if self._on else 0.0

    @property
    def force_n(self) -> float:
        """Normal force on the skin."""
        return float(self.wrench[2])

    @property
    def wrench(self) -> NDArray[np.float64]:
        """(4,) fx, fy, fz in N and tz in N·mm of the whole contact; see :class:`TrueState`."""
        state = self._state
        cell = self.grid.cell_mm2
        pressure = state.pressure_mpa.sum(dtype=np.float64)
        along_x, along_y = state.grip.traction.astype(np.float64)
        x, y = self.grid.nodes_mm + state.displacement_mm[:2]
        turning = (x * along_y - y * along_x).sum()
        return cell * np.array([along_x.sum(), along_y.sum(), pressure, turning])

    def reset(self) -> None:
        """Take the object away and forget everything that was done to the skin."""
        self._state = self._model.at_rest()
        # What is kept while the object moves: its depth_mm or its force_n.
        self._load: dict[str, float] = {}
        self._on, self.time_s = False, 0.0

    def indent_with(
        self, indenter: Indenter, *, x_mm: float = 0.0, y_mm: float = 0.0, angle_deg: float = 0.0
    ) -> None:
        """Choose the object that is pressed next, and hold it above the skin.

        Parameters
        ----------
        indenter : Indenter
        x_mm, y_mm : float
            Where its origin comes, from the image centre.
        angle_deg : float
            Its turn, from x towards y.

        Raises
        ------
        InputError
            Another object is still pressed, or the place is not above the gel.
        """
        if self._on:
            raise InputError("an object is still pressed; release it before taking another one")
        width, height = self._extent
        if not (abs(x_mm) <= width / 2 and abs(y_mm) <= height / 2):
            raise InputError(
                f"({x_mm:g}, {y_mm:g}) mm is beside the gel; place the object within "
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
        """Lower or raise the object, in even steps.

        Parameters
        ----------
        depth_mm : float, optional
            How far below the place of the first touch; kept in what follows.
        force_n : float, optional
            Normal force, instead; kept in what follows.
        steps : int, optional
        seconds : float, optional

        Raises
        ------
        InputError
            Both or none are given, one is negative, there is no object, it would reach the plate
            behind the gel, or it passes beside the gel.
        """
        if (depth_mm is None) == (force_n is None):
            raise InputError("press needs either depth_mm or force_n, and not both")
        wanted = depth_mm if depth_mm is not None else force_n
        assert wanted is not None
        by_force = force_n is not None
        if not (np.isfinite(wanted) and (wanted > 0 if by_force else wanted >= 0)):
            raise InputError(
                f"force_n should be above 0, not {wanted:g}; release() takes the object away"
                if by_force
                else f"depth_mm should be 0 or more, not {wanted:g}"
            )
        if not by_force:
            self.gel.check_depth(wanted)
        count = checked_steps(_PRESS_STEPS[self.mode] if steps is None else steps)
        duration = checked_seconds(seconds)
        with self._undone_on_error():
            if not self._on:
                self._touch(wanted, by_force=by_force)
            start = self.force_n if by_force else self._state.depth_mm
            for share in np.arange(1, count + 1) / count:
                load = start + share * (wanted - start)
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
        """Move the object along the skin by (dx, dy) mm, in even steps.

        Raises
        ------
        InputError
            Nothing is pressed, or the number of steps or seconds makes no sense.
        """
        self._follow(self._path(dx_mm, dy_mm, 0.0, steps, seconds))

    def twist(self, degrees: float, steps: int = 1, *, seconds: float | None = None) -> None:
        """Turn the object about its own origin, from x towards y, in even steps.

        Raises
        ------
        InputError
            Nothing is pressed, or the number of steps or seconds makes no sense.
        """
        self._follow(self._path(0.0, 0.0, degrees, steps, seconds))

    def roll(
        self,
        dx_mm: float = 0.0,
        dy_mm: float = 0.0,
        steps: int = 1,
        *,
        seconds: float | None = None,
    ) -> None:
        """Roll the object by (dx, dy) mm, in even steps.

        Raises
        ------
        InputError
            Nothing is pressed, the object cannot roll that way, or the number of steps or seconds
            makes no sense.
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

    def hold(self, seconds: float) -> None:
        """Let time pass while the object stays where it is, or presses as hard as it does.

        Raises
        ------
        InputError
            The seconds are negative.
        """
        steps = slowing_steps(checked_seconds(seconds))
        if self._on:
            self._follow([(self._state.pose, duration) for duration in steps])
            return
        for duration in steps:
            self._state = self._model.released(self._state, duration)
            self.time_s += duration

    def release(self, seconds: float | None = None) -> None:
        """Take the object away, and let the skin recover for some seconds; by default, fully."""
        duration = checked_seconds(seconds)
        self._state = self._model.released(self._state, duration)
        self._on, self._load = False, {}
        if np.isfinite(duration):
            self.time_s += duration

    def carried(self, points_mm: ArrayLike) -> NDArray[np.float64]:
        """Where points of the skin are now.

        Parameters
        ----------
        points_mm : (N, 2)
            x and y of the points on the untouched skin, from the image centre; markers, say.

        Returns
        -------
        (N, 2) float64
        """
        from scipy.ndimage import map_coordinates

        points = np.array(points_mm, np.float64).reshape(-1, 2)
        grid = self.grid
        first = np.array([grid.x_mm[0], grid.y_mm[0]])
        column, row = ((points - first) / grid.spacing_mm).T
        moved = [
            map_coordinates(part.astype(np.float64), [row, column], order=3, mode="nearest")
            for part in self._state.displacement_mm[:2]
        ]
        return np.asarray(points + np.stack(moved, 1))

    def carried_px(self, points_px: ArrayLike) -> NDArray[np.float64]:
        """Where points of the skin are now in the image.

        Parameters
        ----------
        points_px : (N, 2)
            x and y of the points on the untouched skin.

        Returns
        -------
        (N, 2) float64
        """
        height, width = self.image_shape
        middle = np.array([width - 1, height - 1]) / 2
        points = (np.array(points_px, np.float64).reshape(-1, 2) - middle) * self.mm_per_px
        return np.asarray(self.carried(points) / self.mm_per_px + middle)

    def truth(self) -> TrueState:
        """Return all that is true of the skin now, at the pixels of the image.

        ``markers_px`` are where the printed markers are now; some lie beyond the image.
        """
        return self._true(self.markers_px)

    def seen(
        self, compiled: ModuleType | None = None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Height (H, W) and displacement (H, W, 2) of the truth in mm, for a camera.

        Parameters
        ----------
        compiled : module, optional
            :mod:`tactile_core.sim.kernels.compiled`: the same but for rounding, and sooner.
        """
        if compiled is None:
            truth = self._true(())
            return truth.height_mm, truth.displacement_mm
        return self._sampler.seen(self._state.displacement_mm, compiled)

    def _true(self, markers_px: ArrayLike) -> TrueState:
        state = self._state
        return TrueState(
            self.wrench,
            self.carried_px(markers_px),
            self.time_s,
            state.pose,
            state.depth_mm,
            self.mm_per_px,
            state,
            self._sampler,
        )

    def _build(self, spacing_mm: float) -> None:
        grid = Grid.covering(*self._extent, spacing_mm)
        layer = ElasticLayer(grid, self.gel.elastomer)
        self._model = ContactModel(layer, self.gel, _PRECISION[self.mode])
        self._sampler = ImageSampler(grid, self.image_shape, self.mm_per_px)

    def _touch(self, wanted: float, *, by_force: bool) -> None:
        """Bring the object to where it touches, on a grid fine enough for what is to come."""
        if self._indenter is None:
            raise InputError("there is no object to press; choose an indenter first")
        if self.mode == "accurate" and not self._state.displacement_mm.any() and wanted > 0:
            move = Move(self._pose, *((None, wanted) if by_force else (wanted, None)))
            coarsest = max(self._extent) / _NODES_ACROSS["accurate"]
            self._build(accurate_spacing(self.gel, self._extent, coarsest, self._indenter, move))
            self._state = self._model.at_rest()
        placed = self._model.placed(self._state, self._indenter, self._pose)
        if placed.level_mm < -2 * max(self._extent):
            raise InputError("the object passes beside the gel; place it above the gel")
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

    def _advance(self, pose: Pose, seconds: float, *, rolls: bool = False) -> None:
        assert self._indenter is not None
        move = Move(pose, seconds=seconds, rolls=rolls, **self._load)
        new = self._model.step(self._state, self._indenter, move)
        self.gel.check_depth(new.depth_mm)
        self._state = new
        if np.isfinite(seconds):
            self.time_s += seconds
