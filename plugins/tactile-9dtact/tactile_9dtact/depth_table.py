"""Tables of 9DTact: the deeper the gel is pressed, the darker is its image.

A sensor's folder has ``Pixel_to_Depth.npy``, the depth in mm for each grey level by which a pixel
has become darker; ``row_index.npy`` and ``col_index.npy``, from where in the camera's image each
pixel of the rectified one comes; and ``position_scale.npy``, row and column of the middle of the
gel and the scale in mm per px of the rectified image.

References
----------
.. [1] C. Lin et al., "9DTact: A Compact Vision-Based Tactile Sensor for Accurate 3D Shape
   Reconstruction and Generalizable 6D Force Estimation", IEEE RA-L 9(2), 2024; and its program,
   class ``Sensor``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_9dtact.darkness import measurable
from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npy
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.importer import Importer
from tactile_core.interfaces.slope_models.model_file import stored_model, write_model
from tactile_core.interfaces.slope_models.samples import ImageShape, check_fitting
from tactile_core.quantities import Bool, Float32, Frame, HeightMap, Reference

# As in the program's own configuration
_LEAST = 2  # [grey levels] Less darkening is noise
_MOST = 100  # [grey levels] Beyond the least; more darkening is not of the gel
_KERNEL = (7, 7)  # [px] Of the smoothing of the darkening, and twice of the depth

_SAME_SCALE = 0.01  # [relative] Scales of a profile and a table may differ by as much


@dataclass(frozen=True, eq=False)
class Rectification:
    """Where in the camera's image each pixel of the rectified image comes from.

    Attributes
    ----------
    rows, columns : (H, W) int32
    """

    rows: NDArray[np.int32]
    columns: NDArray[np.int32]

    def apply(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return the rectified image."""
        return np.asarray(image[self.rows, self.columns])

    @property
    def seen(self) -> Bool:
        """(H, W) bool: the pixel comes from the camera's image; others refer to its corner."""
        return np.asarray((self.rows > 0) | (self.columns > 0))


class DepthTable(Calibration):
    """Depth by how much darker than the reference a pixel is.

    Parameters
    ----------
    depth_mm : (N,) float32
        Depth for each grey level of 255 by which a pixel is darker.
    shape : (H, W, 3)
        Shape of the images.
    rectification : Rectification or None
        None if the images are rectified when they arrive. Else heights are of the rectified image.
    """

    def __init__(
        self, depth_mm: Float32, shape: ImageShape, rectification: Rectification | None
    ) -> None:
        self.depth_mm, self.shape, self.rectification = depth_mm, shape, rectification

    def measure(self, frame: Frame, reference: Reference) -> HeightMap:
        """Return the depth of one frame.

        Raises
        ------
        CalibrationError
            Frame or reference is no colour image of the size that the table was imported for.
        """
        check_fitting(frame, reference, self.shape)
        valid: Bool = measurable(frame)
        darker = _grey(reference).astype(np.float32) - _grey(frame)
        if self.rectification is not None:
            valid, darker = map(self.rectification.apply, (valid, darker))
            valid &= self.rectification.seen
            darker[~self.rectification.seen] = 0
        signal = darker - _LEAST
        signal[(signal < 0) | (signal >= _MOST)] = 0
        level = np.minimum(signal + _LEAST, len(self.depth_mm) - 1)
        level = cv2.GaussianBlur(level, _KERNEL, 0).astype(np.intp)
        height = self.depth_mm[level] - self.depth_mm[_LEAST]
        for _ in range(2):
            height = np.asarray(cv2.GaussianBlur(height, _KERNEL, 0))
        return HeightMap(height, valid, frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        arrays: dict[str, NDArray[Any]] = {"depth_mm": self.depth_mm}
        if self.rectification is not None:
            arrays |= vars(self.rectification)
        write_model(directory, self.shape, arrays)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            The file is missing, damaged or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            depth_mm = np.asarray(arrays["depth_mm"], np.float32)
            if depth_mm.ndim != 1 or len(depth_mm) <= _LEAST or not np.isfinite(depth_mm).all():
                raise ValueError("the table has another size")
            rectification = None
            if "rows" in arrays:
                rectification = _rectification(arrays["rows"], arrays["columns"])
                if rectification.rows.shape != shape[:2]:
                    raise ValueError("the rectification is of another size")
            return cls(depth_mm, shape, rectification)


def _grey(image: Frame | Reference) -> NDArray[np.uint8]:
    pixels = image.pixels * np.float32(255 / image.full_scale)
    return np.asarray(cv2.cvtColor(np.rint(pixels).astype(np.uint8), cv2.COLOR_RGB2GRAY))


def _rectification(rows: NDArray[Any], columns: NDArray[Any]) -> Rectification:
    """Check that positions are within an image of their own size; ValueError if they are not."""
    if (
        rows.ndim != 2
        or rows.shape != columns.shape
        or {rows.dtype.kind, columns.dtype.kind} != {"i"}
    ):
        raise ValueError("the positions are no images of whole numbers of one size")
    for positions, size in ((rows, rows.shape[0]), (columns, rows.shape[1])):
        if positions.min() < 0 or positions.max() >= size:
            raise ValueError("a position is outside the image")
    return Rectification(rows.astype(np.int32), columns.astype(np.int32))


class DepthTableImporter(Importer):
    """Reads a sensor's folder of 9DTact, with its files in it or in folders below it.

    If the profile's image is as large as the camera's, the model rectifies it; if it is smaller,
    it is taken to be rectified and cropped already.
    """

    def read(self, path: Path, build: SensorBuild) -> DepthTable:
        """Return the table in the folder; see :meth:`Importer.read`."""
        depth_mm = _read(path, "Pixel_to_Depth.npy", "f")
        if depth_mm.ndim != 1 or not _LEAST < len(depth_mm) <= 256:
            raise InputError(
                f"Pixel_to_Depth.npy in {path} is {depth_mm.shape}, not one depth for each of "
                "at most 256 grey levels; give a folder of 9DTact's calibration"
            )
        position_scale = _read(path, "position_scale.npy", "f")
        if position_scale.shape != (3,):
            raise InputError(
                f"position_scale.npy in {path} is {position_scale.shape}, not row, column and "
                "scale; give a folder of 9DTact's calibration"
            )
        scale = float(position_scale[2])
        if abs(build.image.mm_per_px - scale) > _SAME_SCALE * scale:
            raise InputError(
                f"{path} is of images at {scale:.4g} mm per px and the profile {build.name} says "
                f"{build.image.mm_per_px:.4g}; correct 'image.mm_per_px'"
            )
        shape = (build.image.height_px, build.image.width_px, 3)
        indices = [_read(path, f"{name}_index.npy", "i") for name in ("row", "col")]
        try:
            rectification = _rectification(*indices)
        except ValueError as error:
            raise InputError(
                f"row_index.npy and col_index.npy in {path} cannot be used, as {error}; give a "
                "folder of 9DTact's calibration"
            ) from error
        raw = rectification.rows.shape
        if shape[0] > raw[0] or shape[1] > raw[1]:
            raise InputError(
                f"{path} is of a camera of {raw[1]} × {raw[0]} and the profile {build.name} of "
                f"larger images, {shape[1]} × {shape[0]}; correct 'image'"
            )
        whole = shape[:2] == raw
        return DepthTable(depth_mm.astype(np.float32), shape, rectification if whole else None)


def _read(folder: Path, name: str, kind: str) -> NDArray[Any]:
    """Read the array of a file in a folder, or in a folder within it."""
    found = sorted(folder.glob(name)) or sorted(folder.glob(f"*/{name}"))
    if len(found) != 1:
        raise InputError(
            f"{folder} has {len(found)} files {name}; give the folder of one sensor of 9DTact, "
            "with Pixel_to_Depth.npy, row_index.npy, col_index.npy and position_scale.npy"
        )
    return read_npy(found[0], kind)
