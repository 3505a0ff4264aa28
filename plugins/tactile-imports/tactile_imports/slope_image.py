"""What the imported models share: which images they take, and which slopes can be measured."""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import Self

import numpy as np

from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.algorithms.light.photometric import bare_mask
from tactile_core.algorithms.slopes.sampling import two_within
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.slope_models.model_file import Arrays, stored_model, write_model
from tactile_core.interfaces.slope_models.samples import ImageShape, check_fitting
from tactile_core.quantities import Bool, Float32, Frame, Gradients, Reference

# [mm/mm] The tangent of 80°: steeper gel hides itself, and colours say nothing about it
STEEPEST = 5.67

COLOURS = 3  # Channels of a colour image, in the order red, green, blue


class SlopeImageModel(Calibration):
    """Slopes of each pixel of a colour image, by a model of another program.

    Attributes
    ----------
    shape : (H, W, 3)
        Shape of the images that the model was imported for.
    """

    shape: ImageShape

    @abstractmethod
    def _slopes(self, frame: Frame, reference: Reference) -> Float32:
        """Return ∂z/∂x and ∂z/∂y at each pixel, (2, H, W)."""

    @abstractmethod
    def _arrays(self) -> Arrays:
        """Return all that the model consists of besides the shape."""

    @classmethod
    @abstractmethod
    def _from_arrays(cls, arrays: Arrays, shape: ImageShape) -> Self:
        """Rebuild the model; LookupError, TypeError or ValueError if the arrays are of another."""

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of one frame.

        Raises
        ------
        CalibrationError
            Frame or reference is no colour image of the size that the model was imported for.
        """
        check_fitting(frame, reference, self.shape)
        return gradients_of(frame, self._slopes(frame, reference))

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        write_model(directory, self.shape, self._arrays())

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            The file is missing, damaged or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            return cls._from_arrays(arrays, shape)


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
