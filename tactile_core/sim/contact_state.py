"""Where an object is, how it moves, and what the skin remembers of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array
from tactile_core.sim.friction import Grip


@dataclass(frozen=True)
class Pose:
    """Where the object is: its own origin in the sensor frame, and its turn from x towards y.

    Attributes
    ----------
    x_mm, y_mm, angle_deg : float
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    angle_deg: float = 0.0

    def into(self, x_mm: Array, y_mm: Array) -> tuple[Array, Array]:
        """Carry points of the sensor frame into the object's own."""
        x, y = x_mm - self.x_mm, y_mm - self.y_mm
        if self.angle_deg == 0:
            return x, y
        angle = np.radians(self.angle_deg)
        cos, sin = np.cos(angle), np.sin(angle)
        return cos * x + sin * y, cos * y - sin * x

    def back(self, x_mm: Array, y_mm: Array) -> tuple[Array, Array]:
        """Carry points of the object's own frame into the sensor frame."""
        angle = np.radians(self.angle_deg)
        cos, sin = np.cos(angle), np.sin(angle)
        return self.x_mm + cos * x_mm - sin * y_mm, self.y_mm + sin * x_mm + cos * y_mm


@dataclass(frozen=True)
class Move:
    """Where the object goes in a step, and how hard it presses.

    Attributes
    ----------
    pose : Pose
    depth_mm, force_n : float or None
        One of them: how far beyond the first touch the object is lowered, or with what force.
    seconds : float
        ``inf``: as slowly as it takes for all stress to relax.
    rolls : bool
        The object rolls to its place, rather than being shifted.
    """

    pose: Pose
    depth_mm: float | None = None
    force_n: float | None = None
    seconds: float = np.inf
    rolls: bool = False


@dataclass(frozen=True, eq=False)
class SurfaceState:
    """Everything that the next step depends on, on the nodes of the grid.

    Every node belongs to a point of the skin: values move with it.

    Attributes
    ----------
    displacement_mm : (3, ny, nx)
        x, y, and how far it is pressed towards the camera.
    pressure_mpa : (ny, nx)
    anchors_mm : (2, ny, nx)
        x and y displacement at which the object holds each node of the contact. It differs from
        the displacement by what the solver left over, which must not add up from step to step.
    grip : Grip
        Shear traction, and the slip in the last step.
    stretches_mm : (branches, 3, ny, nx)
        Of the viscoelastic branches.
    level_mm : float
        Height of the object over its lowest point when it first touches.
    pose : Pose
    depth_mm : float
        How far beyond the first touch the object is lowered.
    iterations : tuple of int
        Of the normal contact and of the friction, in the last step.
    """

    displacement_mm: Array
    pressure_mpa: Array
    anchors_mm: Array
    grip: Grip
    stretches_mm: Array
    level_mm: float = 0.0
    pose: Pose = Pose()
    depth_mm: float = 0.0
    iterations: tuple[int, int] = (0, 0)

    @property
    def contact(self) -> NDArray[np.bool_]:
        """(ny, nx) bool: nodes under pressure."""
        return np.asarray(self.pressure_mpa > 0)

    @property
    def stick(self) -> NDArray[np.bool_]:
        """(ny, nx) bool: nodes in contact that did not move along the object in the last step."""
        slip_mm = np.hypot(*self.grip.slip_mm)
        return np.asarray(self.contact & (slip_mm <= self.grip.resolution_mm))
