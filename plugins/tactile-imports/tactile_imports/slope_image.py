"""What the imported models share: which images they take, and which slopes can be measured."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.algorithms.light.photometric import bare_mask
from tactile_core.algorithms.slopes.sampling import two_within
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.slope_models.samples import ImageShape
from tactile_core.quantities import Bool, Float32, Frame, Gradients

# [mm/mm] The tangent of 80°: steeper gel hides itself, and colours say nothing about it
STEEPEST = 5.67

COLOURS = 3  # Channels of a colour image, in the order red, green, blue


def colour_shape(build: SensorBuild) -> ImageShape:
    """Return (H, W, 3) of the colour image of a sensor."""
    return build.image.height_px, build.image.width_px, COLOURS


def gradients_of(frame: Frame, slopes: Float32) -> Gradients:
    """Return the slopes (2, H, W) of a frame, valid where its colours can say them."""
    steep = np.hypot(*slopes) > STEEPEST
    gx, gy = np.clip(slopes, -STEEPEST, STEEPEST)
    return Gradients(gx, gy, measurable(frame) & ~steep, frame.mm_per_px, frame.timestamp_s)


def measurable(frame: Frame) -> Bool:
    """Return (H, W) bool: at least two channels show the gel, neither dark nor saturated."""
    limits = LEVELS.dark_share * frame.full_scale, LEVELS.saturation_share * frame.full_scale
    seen = two_within(frame.pixels, *limits)
    if frame.marker_mask is not None:
        seen &= bare_mask(frame.marker_mask)
    return np.asarray(seen.view(np.bool_))
