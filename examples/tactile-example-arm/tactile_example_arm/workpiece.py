"""The workpiece as the sensor feels it, at its place in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from tactile_core import ContactMask, Estimator, External, FieldSpec, HeightMap, Quantity
from tactile_core.quantities import Bool, Float32, MmPerPx, TimestampS


@dataclass(frozen=True, eq=False)
class ArmPose(Quantity):
    """Where the arm holds the sensor.

    Attributes
    ----------
    origin_mm : (3,) float32
        The sensor's origin in the world.
    rotation : (3, 3) float32
        Turns the sensor's axes into the world's.
    """

    origin_mm: Annotated[Float32, FieldSpec("mm", ("xyz",))]
    rotation: Annotated[Float32, FieldSpec("", ("xyz", "sensor"))]
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class Profile3D(Quantity):
    """Height of the workpiece in the world, wherever the sensor touches it.

    Attributes
    ----------
    z_mm : (H, W) float32
        World z of each pixel's piece of the gel surface.
    std_mm : (H, W) float32
        Its standard deviation.
    valid : (H, W) bool
        Where the workpiece touches.
    """

    z_mm: Annotated[Float32, FieldSpec("mm", ("y", "x"), saved_as="workpiece_z_mm")]
    std_mm: Annotated[Float32, FieldSpec("mm", ("y", "x"), std_of="z_mm")]
    valid: Annotated[Bool, FieldSpec(axes=("y", "x"), validity=True)]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class TouchPoint(Quantity):
    """The middle of the contact in the world; None where nothing touches."""

    world_mm: Annotated[Float32 | None, FieldSpec("mm", ("xyz",), saved_as="touch_world_mm")]
    touches: Annotated[bool, FieldSpec(saved_as="touches")]
    timestamp_s: TimestampS = 0.0


class Workpiece(Estimator):
    """Places what is felt in the world, by the pose that comes with each frame."""

    def estimate(
        self, height: HeightMap, contact: ContactMask, pose: External[ArmPose]
    ) -> tuple[Profile3D, TouchPoint]:
        """Return the profile and the middle of the contact."""
        world_mm = (height.points_mm @ pose.rotation.T + pose.origin_mm).astype(np.float32)
        std_mm = np.full_like(height.mm, 0.01)
        profile = Profile3D(
            world_mm[..., 2], std_mm, contact.mask, height.mm_per_px, height.timestamp_s
        )
        touches = bool(contact.mask.any())
        middle = world_mm[contact.mask].mean(axis=0) if touches else None
        return profile, TouchPoint(middle, touches, height.timestamp_s)
