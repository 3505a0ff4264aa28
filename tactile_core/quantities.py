"""What is measured: each quantity's type fixes its unit, its frame and its sign.

Sensor frame: origin at the image centre, x right, y down, z away from the camera towards the
object (right-handed), millimetres. Arrays are read-only; every value is frozen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
Pixels = NDArray[Any]
"""uint8, uint16 or float32 intensities."""

_SHARE_ROWS = 60
"""Shares of a frame are told from so many of its rows."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """Base of everything a :class:`~tactile_core.estimator.Estimator` may take or give.

    A third party's quantity subclasses this and is saved and streamed like ours.
    """

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                view = value.view()
                view.flags.writeable = False
                object.__setattr__(self, field.name, view)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Named arrays to store in an ``.npz``."""
        return {}

    def summary(self) -> Mapping[str, Any]:
        """A few JSON-ready numbers for a line of ``tactile run --json``."""
        return {}


@dataclass(frozen=True, eq=False)
class Image(Quantity):
    """One exposure as a camera delivers it.

    Attributes
    ----------
    pixels : (H, W) or (H, W, 3) uint8 or uint16
        Grey, or colour in R, G, B order.
    timestamp_s, wall_time_s : float
        Host monotonic and wall-clock time at mid-exposure.
    sequence : int
        Counts the camera's images from 0.
    source : str
        Name of the observation it belongs to (a file's stem, a scan's folder); "" when live.
    """

    pixels: Pixels
    timestamp_s: float = 0.0
    wall_time_s: float = 0.0
    sequence: int = 0
    source: str = ""


@dataclass(frozen=True, eq=False)
class Frame(Quantity):
    """One photometric observation in image coordinates: K light channels.

    Attributes
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    channels : tuple of K str
        Names of the light channels, e.g. ``("red", "green", "blue")``.
    full_scale : float
        The intensity at which a channel saturates (255 for 8 bits).
    marks : (H, W) bool or None
        Pixels that show a printed marker instead of the coating; None for a gel without any.
    timestamp_s, wall_time_s : float
        Host monotonic and wall-clock time at mid-observation.
    exposure_times_s : tuple of float
        Timestamp of each light's exposure, in the order of the sequence; a dark one is left out.
    raw : tuple of Image
        The exposures as the camera sent them, where they were asked to be kept.
    """

    pixels: Pixels
    channels: tuple[str, ...]
    mm_per_px: float
    full_scale: float = 255.0
    marks: Bool | None = None
    timestamp_s: float = 0.0
    wall_time_s: float = 0.0
    sequence: int = 0
    source: str = ""
    exposure_times_s: tuple[float, ...] = ()
    raw: tuple[Image, ...] = ()

    @cached_property
    def saturated(self) -> Bool:
        """(H, W, K) bool: the intensity is at the sensor's ceiling and only a lower bound."""
        return np.asarray(self.pixels >= 0.988 * self.full_scale)

    @cached_property
    def saturated_share(self) -> float:
        """Share of the frame's intensities at the ceiling, from some of its rows."""
        return _share(_some(self.pixels) >= 0.988 * self.full_scale)

    @cached_property
    def too_dark_share(self) -> float:
        """Share of the intensities too dark to measure, from some of its rows."""
        return _share(_some(self.pixels) <= 0.012 * self.full_scale)

    def summary(self) -> Mapping[str, Any]:
        """Sequence number, timestamp and source."""
        return {
            "sequence": self.sequence,
            "timestamp_s": self.timestamp_s,
            "source": self.source,
        }


@dataclass(frozen=True, eq=False)
class Reference(Quantity):
    """The untouched sensor: the mean of ``frames`` observations.

    Attributes
    ----------
    pixels : (H, W, K) float32
        Mean intensities, on the scale of the frames.
    noise : float
        Standard deviation of one observation's intensities over time; 0 if only one was taken.
    marks : (H, W) bool or None
        Pixels that show a printed marker instead of the coating; None for a gel without any.
    frames : int
        How many observations were averaged.
    relative : bool
        True when it is merely the first frame of what is measured, so that readings tell the
        change since then.
    """

    pixels: Float32
    channels: tuple[str, ...]
    full_scale: float = 255.0
    marks: Bool | None = None
    noise: float = 0.0
    frames: int = 1
    relative: bool = False


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
        y, x = ((np.arange(n) - (n - 1) / 2) * self.mm_per_px for n in self.mm.shape)
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


def _some(pixels: Pixels) -> Pixels:
    """Whole rows, which are read many times faster than scattered pixels."""
    return pixels[:: max(1, len(pixels) // _SHARE_ROWS)]


def _share(of: NDArray[np.bool_]) -> float:
    return float(np.count_nonzero(of)) / of.size
