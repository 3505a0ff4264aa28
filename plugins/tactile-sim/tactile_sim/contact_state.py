"""Pose and motion of an object, and the state of the gel surface between steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array
from tactile_sim.friction import Grip


@dataclass(frozen=True)
class Pose:
    """Pose of the object in the sensor frame.

    Attributes
    ----------
    x_mm, y_mm : float
        Position of the object's origin.
    angle_deg : float
        Rotation, positive from x towards y.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    angle_deg: float = 0.0

    def to_object_frame(self, x_mm: Array, y_mm: Array) -> tuple[Array, Array]:
        """Transform points from the sensor frame into the object's frame."""
        # numbers of Python do not turn single into double precision
        x, y = x_mm - float(self.x_mm), y_mm - float(self.y_mm)
        if self.angle_deg == 0:
            return x, y
        angle = np.radians(self.angle_deg)
        cos, sin = float(np.cos(angle)), float(np.sin(angle))
        return cos * x + sin * y, cos * y - sin * x

    def back(self, x_mm: Array, y_mm: Array) -> tuple[Array, Array]:
        """Transform points from the object's frame into the sensor frame."""
        angle = np.radians(self.angle_deg)
        cos, sin = np.cos(angle), np.sin(angle)
        return self.x_mm + cos * x_mm - sin * y_mm, self.y_mm + sin * x_mm + cos * y_mm


@dataclass(frozen=True)
class Move:
    """Target of one step: pose and load of the object.

    Attributes
    ----------
    pose : Pose
        Pose at the end of the step.
    depth_mm, force_n : float or None
        Exactly one is given: depth below first contact, or normal force.
    seconds : float
        Duration; ``inf`` is quasi-static, with all stress relaxed.
    rolls : bool
        The object rolls to its new position instead of sliding.
    """

    pose: Pose
    depth_mm: float | None = None
    force_n: float | None = None
    seconds: float = np.inf
    rolls: bool = False


@dataclass(frozen=True, eq=False)
class SurfaceState:
    """State of the gel surface on the nodes of the grid; the next step starts from it.

    Each node is a material point of the surface (Lagrangian description).

    Attributes
    ----------
    displacement_mm : (3, ny, nx)
        x, y, and indentation towards the camera.
    pressure_mpa : (ny, nx)
    anchors_mm : (2, ny, nx)
        x and y displacement at which the object holds each contact node. It differs from the
        displacement by the solver's residual, so that residuals do not accumulate over steps.
    grip : Grip
        Shear traction, and the slip in the last step.
    stretches_mm : (branches, 3, ny, nx)
        Stretch of the viscoelastic branches.
    level_mm : float
        Height of the object's lowest point at first contact.
    pose : Pose
    depth_mm : float
        Depth of the object below first contact.
    iterations : tuple of int
        Iterations of the normal contact and of the friction, in the last step.
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

    @cached_property
    def stick(self) -> NDArray[np.bool_]:
        """(ny, nx) bool: contact nodes that did not slip along the object in the last step."""
        x, y = self.grip.slip_mm
        return np.asarray(self.contact & (x * x + y * y <= self.grip.resolution_mm**2))
