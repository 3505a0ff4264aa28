"""What is true of the virtual skin, at the pixels of the image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.sim.contact_step import Pose

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Truth:
    """What is true of the virtual skin; units, frame and signs as in the measured quantities.

    Dense values live at the current image position: the value at x belongs to the skin now at x.

    Attributes
    ----------
    height_mm : (H, W) float32
        Positive where pressed towards the camera, relative to the rest surface.
    gradients : (H, W, 2) float32
        ∂z/∂x and ∂z/∂y of it.
    contact : (H, W) bool
    stick : (H, W) bool
        In contact, and not moving along the object in the last increment.
    displacement_mm : (H, W, 2) float32
        +x right, +y down.
    wrench : (4,) float64
        fx, fy in N as the object drags the skin, fz in compression positive, tz in N·mm about the
        z axis through the image centre, positive from x towards y; of the whole contact, also
        beyond the view.
    time_s : float
        What quasi-static increments take is not counted.
    pose : Pose
        Of the object.
    depth_mm : float
        How far beyond the first touch the object is lowered.
    mm_per_px : float
    """

    height_mm: Float32
    gradients: Float32
    contact: Bool
    stick: Bool
    displacement_mm: Float32
    wrench: NDArray[np.float64]
    time_s: float
    pose: Pose
    depth_mm: float
    mm_per_px: float
