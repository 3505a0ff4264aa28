"""What can be read from a deformed gel surface: loads, positions of points, ground truth."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.contact_state import SurfaceState
from tactile_sim.contact_step import ContactModel
from tactile_sim.gel import BallImprint
from tactile_sim.indenters import Indenter
from tactile_sim.resampling import ImageSampler
from tactile_sim.truth import TrueState


class DeformedSurface:
    """Current state of a gel surface, and what follows from it.

    Attributes
    ----------
    markers_px : (N, 2) float64
        Centres of the printed markers on the undeformed surface.
    image_shape : (height, width) in px
    mm_per_px : float
    time_s : float
        Simulated time.
    """

    markers_px: NDArray[np.float64]
    image_shape: tuple[int, int]
    mm_per_px: float
    time_s: float
    _state: SurfaceState
    _model: ContactModel
    _sampler: ImageSampler
    _indenter: Indenter | None
    _on: bool

    @property
    def state(self) -> SurfaceState:
        """State of the gel surface on the nodes."""
        return self._state

    @property
    def grid(self) -> SurfaceGrid:
        """Grid of nodes."""
        return self._model.layer.grid

    @property
    def force_n(self) -> float:
        """Normal force on the gel surface."""
        return float(self.wrench[2])

    @property
    def wrench(self) -> NDArray[np.float64]:
        """(4,) fx, fy, fz in N and tz in N·mm of the whole contact; see :class:`TrueState`."""
        state = self._state
        cell = self.grid.cell_mm2
        pressure = state.pressure_mpa.sum(dtype=np.float64)
        along_x, along_y = state.grip.traction.astype(np.float64)
        x, y = self.grid.nodes_mm + state.displacement_mm[:2]
        torque = (x * along_y - y * along_x).sum()
        return cell * np.array([along_x.sum(), along_y.sum(), pressure, torque])

    def carry_points(self, points_mm: ArrayLike) -> NDArray[np.float64]:
        """Return the current positions of points of the gel surface, for example its markers.

        Parameters
        ----------
        points_mm : (N, 2)
            x and y on the undeformed surface, relative to the image centre.

        Returns
        -------
        (N, 2) float64
        """
        points = np.array(points_mm, np.float64).reshape(-1, 2)
        if not len(points):
            return points
        return points + self._sampler.at_points(self._state.displacement_mm, points)

    def carried_px(self, points_px: ArrayLike) -> NDArray[np.float64]:
        """Return the current image positions of points of the gel surface.

        Parameters
        ----------
        points_px : (N, 2)
            x and y on the undeformed surface.

        Returns
        -------
        (N, 2) float64
        """
        height, width = self.image_shape
        middle = np.array([width - 1, height - 1]) / 2
        points = (np.array(points_px, np.float64).reshape(-1, 2) - middle) * self.mm_per_px
        return np.asarray(self.carry_points(points) / self.mm_per_px + middle)

    def truth(self) -> TrueState:
        """Return the ground truth of the current state, at the pixels of the image.

        Some of its ``markers_px`` may be outside the image.
        """
        state = self._state
        return TrueState(
            self.wrench,
            self.carried_px(self.markers_px),
            self.time_s,
            state.pose,
            state.depth_mm,
            self.mm_per_px,
            state,
            self._sampler,
            self._model,
            self._imprint,
        )

    @property
    def _imprint(self) -> BallImprint | None:
        """The object's own surface; None without contact, or if the object is deformed too."""
        if not self._on or self._indenter is None or not self._state.contact.any():
            return None
        return BallImprint(self._indenter, self._model.gel, self.grid, self._state, self.mm_per_px)
