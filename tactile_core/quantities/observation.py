"""What a camera has shown: frames, references, observations, and which gel they show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.algorithms.light.drift import LEVELS
from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity

if TYPE_CHECKING:
    from tactile_core.quantities.markers import MarkerDetections


Pixels = NDArray[Any]  # uint8, uint16 or float32 intensities


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
        Number of the camera's image, from 0.
    source : str
        Name of its observation (a file's stem, a scan's folder); empty for live images.
    exposure_index : int or None
        Index of the exposure within the observation, from 0; None if the camera does not report
        it.
    exposure_time_s, gain : float or None
        Exposure time, and gain in the camera's own units; None if the camera does not report them.
    standalone : bool
        It is one of unrelated images, so that what changed since the one before is no motion.
    encoded : bytes or None
        The compressed image as the camera sent it, for example a JPEG; None if it sent pixels.
    """

    pixels: Pixels
    timestamp_s: float = 0.0
    wall_time_s: float = 0.0
    sequence: int = 0
    source: str = ""
    exposure_index: int | None = None
    exposure_time_s: float | None = None
    gain: float | None = None
    standalone: bool = False
    encoded: bytes | None = None


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
        Pixels that show a printed marker instead of the coating; None for a gel without markers.
    marker_contrast : (h, w) uint8 or None
        Bottom-hat image that markers are detected in: by which share a pixel is darker than its
        surroundings, 255 for black, downscaled by an integer factor. None before markers are
        detected.
    timestamp_s, wall_time_s : float
        Host monotonic and wall-clock time at mid-observation.
    exposure_times_s : tuple of float
        Timestamp of each light's exposure, in the order of the sequence, without the dark
        exposure.
    raw : tuple of Image
        The exposures as the camera sent them; empty unless requested.
    standalone : bool
        It shows no motion since the frame before; as of :class:`Image`.
    light_ratio : (K,) float32 or None
        Brightness of each channel on the undeformed surface over that in the reference, before it
        is compensated; None if it is not measured, as where an object covers the whole view.
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
    standalone: bool = False
    light_ratio: Float32 | None = None

    def beside(self, **values: Any) -> Self:
        """Return a copy with other values than the pixels; what follows from these is kept."""
        copy = object.__new__(type(self))
        vars(copy).update(values)
        copy.__post_init__()
        # all that a frame computes and keeps follows from its pixels
        vars(copy).update(vars(self) | vars(copy))
        return copy

    @property
    def name(self) -> str:
        """Name of the observation; for live frames the sequence number with six digits."""
        return self.source or f"{self.sequence:06d}"

    @cached_property
    def halves(self) -> NDArray[np.uint8] | None:
        """(H / 2, W / 2, 3) uint8: means over 2 × 2 pixels; None for other than bytes of 3 colours.

        Reading a whole image takes longer than most steps, and many need no more than this.
        """
        rows, columns, channels = self.pixels.shape
        if self.pixels.dtype != np.uint8 or channels != 3 or rows % 2 or columns % 2:
            return None
        halves = np.asarray(shrink_image(self.pixels, (columns // 2, rows // 2)), np.uint8)
        halves.flags.writeable = False
        return halves

    @cached_property
    def saturated(self) -> Bool:
        """(H, W, K) bool: the intensity is saturated, so that it is only a lower bound."""
        return np.asarray(self.pixels >= LEVELS.saturation_share * self.full_scale)

    @cached_property
    def saturated_share(self) -> float:
        """Share of saturated intensities, estimated from some rows."""
        level = LEVELS.saturation_share * self.full_scale
        return _share(_some(self.pixels) >= _whole(ceil(level), level, self.pixels))

    @cached_property
    def too_dark_share(self) -> float:
        """Share of intensities too dark to measure, estimated from some rows."""
        level = LEVELS.dark_share * self.full_scale
        return _share(_some(self.pixels) <= _whole(floor(level), level, self.pixels))

    def pictures(self) -> dict[str, Image]:
        """Return the images of the observation by name.

        As the camera sent them if they were kept: ``camera``, or ``camera_0`` and so on for several
        exposures. Else in image coordinates: ``image``, or ``image_`` and the channel if these are
        neither one nor three.
        """
        if self.raw:
            if len(self.raw) == 1:
                return {"camera": self.raw[0]}
            return {f"camera_{number}": image for number, image in enumerate(self.raw)}
        count = self.pixels.shape[2]
        if count in (1, 3):
            planes = {"image": self.pixels[..., 0] if count == 1 else self.pixels}
        else:
            names = enumerate(self.channels)
            planes = {f"image_{name}": self.pixels[..., number] for number, name in names}
        stamps = self.timestamp_s, self.wall_time_s, self.sequence, self.source
        return {name: Image(np.ascontiguousarray(p), *stamps) for name, p in planes.items()}

    def summary(self) -> Mapping[str, Any]:
        """Return sequence number, timestamp and source."""
        return {
            "sequence": self.sequence,
            "timestamp_s": self.timestamp_s,
            "source": self.source,
        }


@dataclass(frozen=True, eq=False)
class Reference(Quantity):
    """The undeformed sensor: the mean of ``frames`` observations.

    Attributes
    ----------
    pixels : (H, W, K) float32
        Mean intensities, on the scale of the frames.
    noise : float
        Temporal standard deviation of the intensities of one observation; 0 for a single one.
    marker_mask : (H, W) bool or None
        Pixels that show a printed marker instead of the coating; None for a gel without markers.
    frames : int
        Number of averaged observations.
    relative : bool
        True if the reference is the first frame of the measurement itself, so that readings are
        changes relative to it.
    detections : MarkerDetections or None
        Markers of the undeformed gel surface, found by the profile's own detector and added by the
        pipeline. None if no step detects markers.
    """

    pixels: Float32
    channels: tuple[str, ...]
    full_scale: float = LEVELS.full_scale_8_bit
    marker_mask: Bool | None = None
    noise: float = 0.0
    frames: int = 1
    relative: bool = False
    detections: MarkerDetections | None = None

    @cached_property
    def too_dark_share(self) -> float:
        """Share of intensities too dark to measure, as a lens that darkens the corners leaves."""
        return _share(_some(self.pixels) <= LEVELS.dark_share * self.full_scale)

    def as_frame(self, mm_per_px: float) -> Frame:
        """Return the frame of the same intensities, rounded to integers like a camera's."""
        dtype = np.uint8 if self.full_scale <= np.iinfo(np.uint8).max else np.uint16
        pixels = np.rint(self.pixels).astype(dtype)
        return Frame(pixels, self.channels, mm_per_px, self.full_scale, self.marker_mask)


def _some(pixels: Pixels) -> Pixels:
    """Return some complete rows, which are read many times faster than scattered pixels."""
    return pixels[:: max(1, len(pixels) // 60)]  # [rows] enough for a share


def _whole(whole: int, level: float, pixels: Pixels) -> float:
    """Return the level to compare with: integers are compared much faster with an integer."""
    largest = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 0
    return whole if whole <= largest else level


def _share(of: NDArray[np.bool_]) -> float:
    return float(np.count_nonzero(of)) / of.size


Cause = Literal[
    "channels_swapped",
    "turned",
    "mirrored",
    "cropped",
    "grey",
    "another_unit",
    "one_sided_light",
    "rolled",
    "unknown",
]

_ADVICE: Mapping[str, str] = {
    "channels_swapped": (
        "its colour channels are in another order than in the reference; give RGB, since OpenCV "
        "delivers BGR"
    ),
    "turned": "it is turned against the reference; correct 'image.rotate_deg' or turn the camera",
    "mirrored": "it is a mirror image of the reference; correct 'image.flip'",
    "cropped": (
        "it shows another part of the view than the reference, or at another scale; choose the "
        "camera's mode of the calibration, or correct 'image.crop'"
    ),
    "grey": "its channels are all equal where the reference has colours; record in colour",
    "another_unit": (
        "its light differs from the reference all over, as that of another unit, of another gel or "
        "of an aged one does; record a new reference, and calibrate this unit if that does not help"
    ),
    "one_sided_light": (
        "its light has become brighter on one side than in the reference; check the LEDs, keep "
        "other light out, and record a new reference"
    ),
    "rolled": (
        "it begins in the middle of the view, as where a transfer has lost rows; leave this frame "
        "out, and if there are more of them choose a lower rate, or another cable or port"
    ),
    "unknown": (
        "it looks like nothing that this gel can look like, or is much brighter or darker than in "
        "the reference; check camera, exposure and lights, and record a new reference"
    ),
}


@dataclass(frozen=True, eq=False)
class ShownGel(Quantity):
    """Whether a frame shows the gel of the reference, under the light of the calibration.

    Attributes
    ----------
    this_gel : bool
        False: whatever is measured from this frame is wrong.
    cause : str or None
        What was done to the frame: ``channels_swapped``, ``turned``, ``mirrored``, ``cropped`` (or
        scaled), ``grey``, ``another_unit`` (or an aged gel), ``one_sided_light``, ``rolled``
        (begins in the middle of the view) or ``unknown``; None if nothing was.
    """

    this_gel: Annotated[bool, FieldSpec(saved_as="shows_this_gel")]
    cause: Annotated[Cause | None, FieldSpec(saved_as="shows_cause")] = None
    timestamp_s: TimestampS = 0.0

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``shows`` of a line of ``tactile run --json``."""
        return {"shows": {"this_gel": self.this_gel, "cause": self.cause}}

    def warnings(self) -> tuple[str, ...]:
        """Return what is wrong with the frame, and what to do."""
        if self.this_gel:
            return ()
        return (f"this frame does not show the gel of the reference: {self.advice}",)

    @property
    def advice(self) -> str:
        """What is wrong with a frame that does not show this gel, and what to do."""
        return _ADVICE[self.cause or "unknown"]
