"""The measured surface of a workpiece, in world coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from tactile_core import ContactMask, Estimator, External, FieldSpec, HeightMap, Quantity
from tactile_core.quantities import Bool, Float32, MmPerPx, TimestampS


@dataclass(frozen=True, eq=False)
class ArmPose(Quantity):
    """Pose of the sensor in the world, from the arm.

    Attributes
    ----------
    origin_mm : (3,) float32
        Origin of the sensor frame in world coordinates.
    rotation : (3, 3) float32
        Rotation from the sensor frame to the world frame.
    """

    origin_mm: Annotated[Float32, FieldSpec("mm", ("xyz",))]
    rotation: Annotated[Float32, FieldSpec("", ("xyz", "sensor"))]
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class Profile3D(Quantity):
    """Height of the workpiece in the world, measured in the contact area.

    Attributes
    ----------
    z_mm : (H, W) float32
        World z of the gel surface at each pixel.
    std_mm : (H, W) float32
        Standard deviation of ``z_mm``.
    valid : (H, W) bool
        The contact area.
    """

    z_mm: Annotated[Float32, FieldSpec("mm", ("y", "x"), saved_as="workpiece_z_mm")]
    std_mm: Annotated[Float32, FieldSpec("mm", ("y", "x"), std_of="z_mm")]
    valid: Annotated[Bool, FieldSpec(axes=("y", "x"), validity=True)]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class TouchPoint(Quantity):
    """Centre of the contact area in world coordinates; None without contact."""

    world_mm: Annotated[Float32 | None, FieldSpec("mm", ("xyz",), saved_as="touch_world_mm")]
    touches: Annotated[bool, FieldSpec(saved_as="touches")]
    timestamp_s: TimestampS = 0.0


class Workpiece(Estimator):
    """Transforms the height map to world coordinates with the pose of each frame."""

    def estimate(
        self, height: HeightMap, contact: ContactMask, pose: External[ArmPose]
    ) -> tuple[Profile3D, TouchPoint]:
        """Return the profile and the centre of the contact area."""
        world_mm = (height.points_mm @ pose.rotation.T + pose.origin_mm).astype(np.float32)
        std_mm = np.full_like(height.mm, 0.01)
        profile = Profile3D(
            world_mm[..., 2], std_mm, contact.mask, height.mm_per_px, height.timestamp_s
        )
        touches = bool(contact.mask.any())
        centre = world_mm[contact.mask].mean(axis=0) if touches else None
        return profile, TouchPoint(centre, touches, height.timestamp_s)
