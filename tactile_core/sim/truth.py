"""Ground truth of a virtual sensor, at the pixels of the image."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.sim.contact_state import Pose, SurfaceState
from tactile_core.sim.contact_step import ContactModel
from tactile_core.sim.fine_contact import fine_contact
from tactile_core.sim.imprint import Imprint
from tactile_core.sim.resampling import ImageSampler


@dataclass(frozen=True, eq=False)
class TrueState:
    """Ground truth; units, frame and signs are those of the measured quantities.

    Dense fields refer to current image positions: the value at a pixel belongs to the material
    that is there now. They are computed on first access.

    Attributes
    ----------
    wrench : (4,) float64
        Force of the object on the gel: fx, fy in N, fz in N and positive in compression, and tz in
        N·mm about the z axis through the image centre, positive from x towards y. It includes
        contact outside the field of view.
    markers_px : (N, 2) float64
        x and y of the printed markers.
    time_s : float
        Simulated time; quasi-static increments take none.
    pose : Pose
        Pose of the object.
    depth_mm : float
        Depth of the object below first contact.
    mm_per_px : float
    """

    wrench: NDArray[np.float64]
    markers_px: NDArray[np.float64]
    time_s: float
    pose: Pose
    depth_mm: float
    mm_per_px: float
    _state: SurfaceState = field(repr=False)
    _sampler: ImageSampler = field(repr=False)
    _model: ContactModel = field(repr=False)
    _imprint: Imprint | None = field(repr=False)

    @cached_property
    def height_mm(self) -> Float32:
        """(H, W) indentation relative to the undeformed surface, positive towards the camera."""
        height = self._sampler.values(self._now[2])
        if self._imprint is not None:
            self._imprint.deepen(height, self.displacement_mm)
        return height

    @cached_property
    def gradients(self) -> Float32:
        """(H, W, 2) ∂z/∂x and ∂z/∂y of the height."""
        slopes = self._sampler.slopes(self._now[2])
        if self._imprint is not None:
            rows, columns = self._imprint.window(self._sampler.shape)
            # one pixel more, where there is one, for central differences at the window's border
            above, left = min(rows.start, 1), min(columns.start, 1)
            wide = self.height_mm[
                rows.start - above : rows.stop + 1, columns.start - left : columns.stop + 1
            ]
            if min(wide.shape) > 1:
                down, right = np.gradient(wide, self.mm_per_px)
                inside = np.stack([right, down], -1)[above:, left:]
                slopes[rows, columns] = inside[
                    : rows.stop - rows.start, : columns.stop - columns.start
                ]
        return slopes

    @cached_property
    def displacement_mm(self) -> Float32:
        """(H, W, 2) displacement from the undeformed surface: +x right, +y down."""
        images = np.stack([self._sampler.values(part) for part in self._now[:2]])
        return np.moveaxis(images, 0, 2)

    @cached_property
    def contact(self) -> Bool:
        """(H, W) contact area. Its outline is finer than the nodes of the mechanics."""
        if not self._state.contact.any():
            return np.zeros(self._sampler.shape, np.bool_)
        fine = None if self._imprint is None else fine_contact(self._model, self._imprint)
        if fine is None:
            return self._sampler.mask(self._state.contact, self._places)
        return fine.at(*self._places)

    @cached_property
    def stick(self) -> Bool:
        """(H, W) stick region: contact without slip in the last increment."""
        from scipy.ndimage import distance_transform_edt

        touching, sticking = self._state.contact, self._state.stick
        if not sticking.any():
            return np.zeros(self._sampler.shape, np.bool_)
        # beyond the outermost nodes of the contact, the outline's state is the nearest node's
        _, nearest = distance_transform_edt(~touching, return_indices=True)
        return self.contact & self._sampler.mask(sticking[tuple(nearest)], self._places)

    @cached_property
    def _places(self) -> Float32:
        """(2, H, W) original row and column, on the nodes, of the material now at each pixel."""
        return np.stack([self._sampler.values(part) for part in self._origins])

    @cached_property
    def _origins(self) -> Float32:
        return self._sampler.origins(self._state.displacement_mm[:2])

    @cached_property
    def _now(self) -> Float32:
        """(3, my, mx) displacement and indentation at the needed nodes, which do not move."""
        return self._sampler.at_present(self._state.displacement_mm, self._origins)
