"""What is true of the virtual skin, at the pixels of the image."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.sim.contact_state import Pose, SurfaceState
from tactile_core.sim.resampling import ImageSampler


@dataclass(frozen=True, eq=False)
class TrueState:
    """What is true of the virtual skin; units, frame and signs as in the measured quantities.

    Dense values live at the current image position: the value at x belongs to the skin now at x.
    They are computed when they are first asked for.

    Attributes
    ----------
    wrench : (4,) float64
        fx, fy in N as the object drags the skin, fz in compression positive, tz in N·mm about the
        z axis through the image centre, positive from x towards y; of the whole contact, also
        beyond the view.
    markers_px : (N, 2) float64
        x and y of the printed markers.
    time_s : float
        What quasi-static increments take is not counted.
    pose : Pose
        Of the object.
    depth_mm : float
        How far beyond the first touch the object is lowered.
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

    @cached_property
    def height_mm(self) -> Float32:
        """(H, W) positive where pressed towards the camera, relative to the rest surface."""
        return self._sampler.values(self._height_now)

    @cached_property
    def gradients(self) -> Float32:
        """(H, W, 2) ∂z/∂x and ∂z/∂y of the height."""
        return self._sampler.slopes(self._height_now)

    @cached_property
    def displacement_mm(self) -> Float32:
        """(H, W, 2) of the skin since it was untouched: +x right, +y down."""
        moved = self._state.displacement_mm[:2]
        now = [self._sampler.at_present(part, self._origins) for part in moved]
        return np.moveaxis(np.stack([self._sampler.values(part) for part in now]), 0, 2)

    @cached_property
    def contact(self) -> Bool:
        """(H, W) where the object touches."""
        return self._mask(self._state.contact)

    @cached_property
    def stick(self) -> Bool:
        """(H, W) in contact, and not moving along the object in the last increment."""
        return self._mask(self._state.stick)

    @cached_property
    def _origins(self) -> NDArray[Any]:
        return self._sampler.origins(self._state.displacement_mm[:2])

    @cached_property
    def _height_now(self) -> NDArray[Any]:
        return self._sampler.at_present(self._state.displacement_mm[2], self._origins)

    def _mask(self, nodes: Bool) -> Bool:
        return self._sampler.mask(self._sampler.now_at_nodes(nodes, self._origins))
