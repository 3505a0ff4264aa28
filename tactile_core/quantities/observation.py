"""What the camera gives: images, frames of K light channels, and the untouched sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.algorithms.levels import LEVELS
from tactile_core.quantities.quantity import Quantity

if TYPE_CHECKING:
    from tactile_core.quantities.markers import MarkerDetections

Pixels = NDArray[Any]
"""uint8, uint16 or float32 intensities."""

_SHARE_ROWS = 60
"""Shares of a frame are told from so many of its rows."""


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
    exposure_index : int or None
        Which exposure of the observation it is, from 0, if the camera knows.
    exposure_time_s, gain : float or None
        How it was exposed, if the camera knows; the gain as the camera counts it.
    """

    pixels: Pixels
    timestamp_s: float = 0.0
    wall_time_s: float = 0.0
    sequence: int = 0
    source: str = ""
    exposure_index: int | None = None
    exposure_time_s: float | None = None
    gain: float | None = None


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
    marker_mask : (H, W) bool or None
        Pixels that show a printed marker instead of the coating; None for a gel without any.
    marker_contrast : (h, w) uint8 or None
        What tells the markers: the share of the light of its surroundings that each pixel lacks,
        255 for all of it, shrunk by a whole factor. None where the markers are not looked for yet.
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
    full_scale: float = LEVELS.full_scale_8_bit
    marker_mask: Bool | None = None
    timestamp_s: float = 0.0
    wall_time_s: float = 0.0
    sequence: int = 0
    source: str = ""
    exposure_times_s: tuple[float, ...] = ()
    raw: tuple[Image, ...] = ()
    marker_contrast: NDArray[np.uint8] | None = None

    @property
    def name(self) -> str:
        """Name of the observation; its sequence number, six digits, when it is live."""
        return self.source or f"{self.sequence:06d}"

    @cached_property
    def saturated(self) -> Bool:
        """(H, W, K) bool: the intensity is at the sensor's ceiling and only a lower bound."""
        return np.asarray(self.pixels >= LEVELS.saturation_share * self.full_scale)

    @cached_property
    def saturated_share(self) -> float:
        """Share of the frame's intensities at the ceiling, from some of its rows."""
        return _share(_some(self.pixels) >= LEVELS.saturation_share * self.full_scale)

    @cached_property
    def too_dark_share(self) -> float:
        """Share of the intensities too dark to measure, from some of its rows."""
        return _share(_some(self.pixels) <= LEVELS.dark_share * self.full_scale)

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
    marker_mask : (H, W) bool or None
        Pixels that show a printed marker instead of the coating; None for a gel without any.
    frames : int
        How many observations were averaged.
    relative : bool
        True when it is merely the first frame of what is measured, so that readings tell the
        change since then.
    detections : MarkerDetections or None
        The markers of the untouched skin, as the profile's own detector finds them; the pipeline
        adds them. None where no step detects markers.
    """

    pixels: Float32
    channels: tuple[str, ...]
    full_scale: float = LEVELS.full_scale_8_bit
    marker_mask: Bool | None = None
    noise: float = 0.0
    frames: int = 1
    relative: bool = False
    detections: MarkerDetections | None = None


def _some(pixels: Pixels) -> Pixels:
    """Whole rows, which are read many times faster than scattered pixels."""
    return pixels[:: max(1, len(pixels) // _SHARE_ROWS)]


def _share(of: NDArray[np.bool_]) -> float:
    return float(np.count_nonzero(of)) / of.size
