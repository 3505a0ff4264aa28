"""The shape of the skin: slopes, heights and where the object touches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class Gradients(Quantity):
    """Slope of the height map, dimensionless (mm per mm).

    Heights are measured from the rest surface, and so are slopes: on a domed gel they are those
    of the skin less those of the dome.

    Attributes
    ----------
    x, y : (H, W) float32
        ∂z/∂x (x right) and ∂z/∂y (y down) of :class:`HeightMap`.
    valid : (H, W) bool
        False where the value was filled in (a marker, saturation).
    """

    x: Float32
    y: Float32
    valid: Bool
    mm_per_px: float
    timestamp_s: float = 0.0

    @property
    def normals(self) -> Float32:
        """(H, W, 3) unit normals of the height map, +z towards the viewer (the camera)."""
        n = np.dstack([-self.x, -self.y, np.ones_like(self.x)])
        return np.asarray(n / np.linalg.norm(n, axis=2, keepdims=True), np.float32)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """``gradients (H, W, 2)``; ``valid`` belongs to the height map where there is one."""
        return {"gradients": np.dstack([self.x, self.y]), "valid": self.valid}


@dataclass(frozen=True, eq=False)
class HeightMap(Quantity):
    """How far the object presses the membrane towards the camera.

    Attributes
    ----------
    mm : (H, W) float32
        Millimetres; positive where pressed, 0 at the rest surface, be it flat or domed.
    valid : (H, W) bool
        False where the gradient beneath was filled in.
    rest_mm : (H, W) float32 or None
        z of the rest surface in the sensor frame, 0 at a dome's apex; None where it is flat.
    """

    mm: Float32
    valid: Bool
    mm_per_px: float
    timestamp_s: float = 0.0
    rest_mm: Float32 | None = None

    @property
    def points_mm(self) -> Float32:
        """(H, W, 3) where the skin is in the sensor frame: x, y, and z = rest − height."""
        y, x = (from_middle(n) * self.mm_per_px for n in self.mm.shape)
        points = np.empty((*self.mm.shape, 3), np.float32)
        points[..., 0] = x
        points[..., 1] = y[:, None]
        points[..., 2] = -self.mm if self.rest_mm is None else self.rest_mm - self.mm
        return points

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """``height_mm``, ``valid``, the scale ``mm_per_px`` and, of a dome, ``rest_mm``."""
        arrays = {
            "height_mm": self.mm,
            "valid": self.valid,
            "mm_per_px": np.asarray(self.mm_per_px),
        }
        return arrays if self.rest_mm is None else arrays | {"rest_mm": self.rest_mm}

    def summary(self) -> Mapping[str, Any]:
        """The largest height."""
        return {"max_height_mm": float(self.mm.max())}

    def shifted(self, offset_mm: float) -> Self:
        """Return the same map raised by ``offset_mm``."""
        return replace(self, mm=self.mm + np.float32(offset_mm))


@dataclass(frozen=True, eq=False)
class ContactMask(Quantity):
    """Where the object touches.

    Attributes
    ----------
    mask : (H, W) bool
    """

    mask: Bool
    mm_per_px: float
    timestamp_s: float = 0.0

    @property
    def area_mm2(self) -> float:
        """Area in contact."""
        return float(np.count_nonzero(self.mask)) * self.mm_per_px**2

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """``contact (H, W) bool``."""
        return {"contact": self.mask}

    def summary(self) -> Mapping[str, Any]:
        """The area in contact."""
        return {"contact_area_mm2": self.area_mm2}
