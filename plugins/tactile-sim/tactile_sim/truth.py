"""The true state of a virtual sensor."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool, Float32
from tactile_sim.contact_state import Pose, SurfaceState
from tactile_sim.contact_step import OUT_OF_REACH_MM, ContactModel
from tactile_sim.gel import BallImprint
from tactile_sim.normal_contact import Window, solve_normal
from tactile_sim.resampling import ImageSampler, spline_matrix


@dataclass(frozen=True, eq=False)
class FineContact:
    """Contact area on a grid of material points, ``factor`` times finer than the nodes.

    Attributes
    ----------
    share : (rows, columns) float32
        Contact share of each fine node's cell.
    first : (row, column)
        The node at which the fine grid starts.
    factor : int
        Fine nodes per node.
    """

    share: Float32
    first: tuple[int, int]
    factor: int

    def contact_at(self, row: Float32, column: Float32) -> NDArray[np.bool_]:
        """Contact at material positions, in rows and columns of the nodes."""
        y, x = (
            (part - np.float32(start)) * np.float32(self.factor)
            for part, start in zip((row, column), self.first, strict=True)
        )
        share = cv2.remap(self.share, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(share > 0.5)


def fine_contact(model: ContactModel, imprint: BallImprint) -> FineContact | None:
    """Solve the contact of the current state between the nodes.

    The displacement that is not due to pressure, such as that of friction and of earlier contacts,
    is smooth and is interpolated from the nodes; the pressure is solved for.

    Parameters
    ----------
    model : ContactModel
    imprint : BallImprint

    Returns
    -------
    FineContact or None
        None if the nodes are fine enough.
    """
    state, grid = imprint.state, imprint.grid
    window = Window.around(state.contact)
    # [nodes along a side] A larger contact is refined less, to bound the time
    most = max(1, 512 // max(window.shape))
    # [px] The outline is within 1.5 px of that on nodes 1 px apart
    # (``experiments/contact_outline.py``)
    wanted = np.ceil(grid.spacing_mm / (1.5 * imprint.mm_per_px) - 1e-6)
    factor = min(int(wanted), most)
    if factor <= 1:
        return None
    (rows, y), (columns, x) = (
        _refine_nodes(nodes[part], factor)
        for nodes, part in ((grid.y_mm, window.rows), (grid.x_mm, window.columns))
    )
    by_pressure = model.layer.indentation(state.pressure_mpa)
    fields = np.concatenate([state.displacement_mm, by_pressure[None], state.pressure_mpa[None]])
    right, down, height, pressed, pressure = rows @ window.view_of(fields) @ columns.T
    gap = imprint.indenter.gap_mm(*state.pose.to_object_frame(x + right, y[:, None] + down))
    x, y = np.broadcast_arrays(x, y[:, None])
    overlap = model.gel.rest_mm(x, y) - gap + (state.depth_mm - state.level_mm)
    # below any gap that counts, and small enough for single precision
    overlap = np.maximum(overlap, OUT_OF_REACH_MM) - (height - pressed)
    solved = solve_normal(
        model.finer(factor).near(x.shape).indentation,
        overlap.astype(model.layer.dtype),
        pressure,
        tolerance=1e-4,  # [share of the largest overlap] the accurate mode
    )
    touching = (solved.pressure > 0).astype(np.float32)
    share = cv2.GaussianBlur(touching, (0, 0), 0.7)  # [fine nodes] half the diagonal of a cell
    first = window.rows.start, window.columns.start
    return FineContact(np.asarray(share, np.float32), first, factor)


def _refine_nodes(nodes: Array, factor: int) -> tuple[Float32, Array]:
    """Matrix that interpolates to positions ``factor`` times denser, and these positions."""
    positions = np.linspace(nodes[0], nodes[-1], (len(nodes) - 1) * factor + 1)
    return spline_matrix(nodes, positions), positions


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
    _imprint: BallImprint | None = field(repr=False)

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
        down, right = np.gradient(self.height_mm, self.mm_per_px, edge_order=2)
        return np.stack([right, down], -1)

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
        return fine.contact_at(*self._places)

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
