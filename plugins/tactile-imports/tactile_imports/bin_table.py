"""Tables of gelsight_heightmap_reconstruction: the change of colour in bins gives the slopes.

``table_smooth.npy`` is an array (90, 90, 90, 2). The first three axes count the change of blue,
green and red, from −90 to 90 grey levels in steps of 2; the last has the steps of the height in mm
from one pixel to the next, to the right and downwards, heights positive where an object presses.
The change is of the image against the reference, both smoothed, and is weighted: where the
reference is half as bright as on average, it counts three times.

The program keeps range and number of bins in its source, and nothing in the file says them.

References
----------
.. [1] S. Dong, gelsight_heightmap_reconstruction (no licence; the layout alone is used), class
   ``calibration`` and function ``matching_v2``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npy
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.importer import Importer
from tactile_core.interfaces.slope_models.model_file import Arrays
from tactile_core.interfaces.slope_models.samples import ImageShape
from tactile_core.quantities import Float32, Frame, Reference
from tactile_imports.slope_image import SlopeImageModel, colour_shape

# As in the program's own source
_BINS = 90  # [count] For each colour
_RANGE = 90.0  # [grey levels of 255] Of the weighted change of a colour, to both sides
_KERNEL = (3, 3)  # [px] Of the smoothing of image and reference
_DARKEST = 1.0  # [grey levels of 255] Added to the reference, which divides
_INPAINT_PX = 3  # Neighbourhood from which markers of the reference are filled

_SHAPE = (_BINS, _BINS, _BINS, 2)


class BinTable(SlopeImageModel):
    """Slopes of the bin that a change of colour falls into.

    Parameters
    ----------
    slopes : (90, 90, 90, 2) float32
        ∂z/∂x and ∂z/∂y by the bins of blue, green and red.
    shape : (H, W, 3)
        Shape of the images.
    """

    def __init__(self, slopes: Float32, shape: ImageShape) -> None:
        self.slopes, self.shape = slopes, shape

    def _slopes(self, frame: Frame, reference: Reference) -> Float32:
        light = _smoothed(_without_markers(reference)) + np.float32(_DARKEST)
        weight = 1 + 2 * (light.mean() / light - 1)
        change = (_smoothed(_levels(frame)) - light) * weight
        share = np.clip((change + _RANGE) / (2 * _RANGE), 0, 0.999)
        blue, green, red = np.moveaxis((share * _BINS).astype(np.intp), 2, 0)
        return np.moveaxis(self.slopes[blue, green, red], 2, 0)

    def _arrays(self) -> Arrays:
        return {"slopes": self.slopes}

    @classmethod
    def _from_arrays(cls, arrays: Arrays, shape: ImageShape) -> Self:
        slopes = np.asarray(arrays["slopes"], np.float32)
        if slopes.shape != _SHAPE or not np.isfinite(slopes).all():
            raise ValueError("the table has another size, or is not finite")
        return cls(slopes, shape)


def _levels(image: Frame | Reference) -> Float32:
    """Return blue, green and red on a scale of 255."""
    return np.asarray(image.pixels[..., ::-1] * np.float32(255 / image.full_scale), np.float32)


def _smoothed(levels: Float32) -> NDArray[Any]:
    return np.asarray(cv2.GaussianBlur(levels, _KERNEL, 0))


def _without_markers(reference: Reference) -> Float32:
    levels = _levels(reference)
    if reference.marker_mask is None:
        return levels
    grey = np.rint(levels).astype(np.uint8)
    markers = reference.marker_mask.astype(np.uint8)
    return cv2.inpaint(grey, markers, _INPAINT_PX, cv2.INPAINT_TELEA).astype(np.float32)


class BinTableImporter(Importer):
    """Reads ``table_smooth.npy`` of gelsight_heightmap_reconstruction."""

    def read(self, path: Path, build: SensorBuild) -> BinTable:
        """Return the table in the file; see :meth:`Importer.read`."""
        steps_mm = read_npy(path, "f")
        if steps_mm.shape != _SHAPE:
            raise InputError(
                f"{path} is {steps_mm.shape}, not {_SHAPE}, two steps of height for 90 changes of "
                "each colour; give the table_smooth.npy of gelsight_heightmap_reconstruction"
            )
        slopes = (steps_mm / build.image.mm_per_px).astype(np.float32)
        return BinTable(slopes, colour_shape(build))
