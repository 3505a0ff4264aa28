"""Conditions frames: markers, drift of the lights, the order of images."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from tactile_core.algorithms.arrays.types import UInt8
from tactile_core.algorithms.light.drift import ReferenceLevels, divide_by_gains
from tactile_core.algorithms.light.sequence import Pattern, SequenceFault, faults, pattern
from tactile_core.algorithms.markers.contrast import (
    Tone,
    contrast_of,
    marker_mask,
    mask_of,
    reduction,
)
from tactile_core.algorithms.markers.count import expected_count, find_detectable_lattice, too_few
from tactile_core.algorithms.markers.detection import find_markers
from tactile_core.errors import InputError, SequenceError
from tactile_core.interfaces.component import GelImage
from tactile_core.interfaces.gel import Gel, Markers
from tactile_core.quantities import Bool, Frame, MarkerDetections, Pixels, Reference


@dataclass(frozen=True)
class MarkerFinder:
    """Finds printed markers of about ``diameter_px`` at a pitch of about ``pitch_px``."""

    tone: Tone
    diameter_px: float
    pitch_px: float

    @classmethod
    def for_gel(cls, build: GelImage, reference: Reference | None = None) -> MarkerFinder | None:
        """Return the finder for a gel, or None for a gel without markers.

        Raises
        ------
        InputError
            The profile has ``markers: auto``, and there is no reference to detect them in.
        """
        markers, mm_per_px = build.gel.markers, build.image.mm_per_px
        if markers is None:
            return None
        if isinstance(markers, Markers):
            sizes_px = markers.diameter_mm / mm_per_px, markers.pitch_mm / mm_per_px
            return cls(markers.tone, *sizes_px)
        if reference is None:
            raise InputError(
                "'gel.markers: auto' needs a reference image to detect the markers in; "
                "give --reference"
            )
        found = find_detectable_lattice(np.asarray(reference.pixels))
        return None if found is None else cls(*found[0])

    def find(self, pixels: Pixels) -> Bool:
        """Return the mask of the markers and their rims, (H, W) bool."""
        return marker_mask(pixels, diameter_px=self.diameter_px, tone=self.tone)

    def mask_frame(self, frame: Frame) -> Frame:
        """Return the frame with its marker mask and marker contrast."""
        marker_contrast = self._contrast(frame)
        marker_mask = mask_of(marker_contrast, frame.pixels.shape[:2])
        return frame.beside(marker_mask=marker_mask, marker_contrast=marker_contrast)

    def detect(self, frame: Frame | Reference) -> MarkerDetections:
        """Detect the centres of the markers; faster for frames from :meth:`mask_frame`."""
        marker_contrast, timestamp_s = None, 0.0
        if isinstance(frame, Frame):
            marker_contrast, timestamp_s = frame.marker_contrast, frame.timestamp_s
        if marker_contrast is None:
            marker_contrast = self._contrast(frame)
        centres_px, cut = find_markers(
            marker_contrast, frame.pixels.shape[:2], diameter_px=self.diameter_px
        )
        return MarkerDetections(centres_px, cut, timestamp_s)

    def _contrast(self, frame: Frame | Reference) -> UInt8:
        return contrast_of(
            frame.pixels,
            diameter_px=self.diameter_px,
            tone=self.tone,
            halves=frame.halves if isinstance(frame, Frame) and self._halves else None,
        )

    @property
    def _halves(self) -> bool:
        return reduction(self.diameter_px) % 2 == 0

    def explain_miscount(self, reference: Reference) -> str:
        """Return how the number of markers contradicts their pitch; empty if it does not."""
        detections = reference.detections or self.detect(reference)
        shape, count = reference.pixels.shape, len(detections.centres_px)
        if not too_few(count, shape, self.pitch_px):
            return ""
        return (
            f"the reference shows {count} {self.tone} markers of {self.diameter_px:.1f} px, but "
            f"about {expected_count(shape, self.pitch_px)} every {self.pitch_px:.1f} px would fill "
            f"the image; {self._remedy(reference)}"
        )

    def _remedy(self, reference: Reference) -> str:
        found = find_detectable_lattice(np.asarray(reference.pixels))
        if found is None:
            return (
                "correct 'gel.markers' (its diameter first) or take a sharper reference, or set "
                "'markers: null' for a gel without"
            )
        (tone, diameter_px, pitch_px), count = found
        return (
            f"it has {count} {tone} ones of {diameter_px:.1f} px every {pitch_px:.1f} px: correct "
            f"'gel.markers' (its {'diameter' if tone == self.tone else 'tone'} first) or set "
            f"'markers: auto'"
        )

    def with_markers(self, gel: Gel, mm_per_px: float) -> Gel:
        """Return the gel with the detected tone, pitch and diameter of its markers."""
        markers = Markers(
            pitch_mm=self.pitch_px * mm_per_px,
            diameter_mm=self.diameter_px * mm_per_px,
            tone=self.tone,
        )
        return gel.model_copy(update={"markers": markers})


class DriftCompensator:
    """Scales frames to the illumination of one reference.

    It keeps nothing from earlier frames, so a contact that is held for long is not absorbed; see
    :class:`~tactile_core.algorithms.light.drift.ReferenceLevels`.

    Parameters
    ----------
    reference : Reference
    divides : bool
        False only measures the change of the light, as ``Frame.light_ratio``.
    """

    def __init__(self, reference: Reference, *, divides: bool = True) -> None:
        self._reference, self._divides = reference, divides
        self._levels = ReferenceLevels(reference.pixels, reference.full_scale)

    def compensate_frame(self, frame: Frame) -> Frame:
        """Return the frame as it would look under the illumination of the reference."""
        reference = self._reference
        if (frame.pixels.shape, frame.full_scale) != (reference.pixels.shape, reference.full_scale):
            return frame
        change = self._levels.change(frame.pixels, frame.marker_mask)
        if change is None:
            return frame
        gains = change.gains
        # [ratio] If no gain differs from 1 by more, the frame is not divided. Source: by hand, (ADR
        # 10).
        if not self._divides or np.abs(gains - 1).max() < 0.002:
            return frame.beside(light_ratio=change.ratio)
        pixels = divide_by_gains(frame.pixels, gains, frame.full_scale)
        return replace(frame, pixels=pixels, light_ratio=change.ratio)


def is_sequential(frame: Frame) -> bool:
    """Whether each channel of the frame is a separate exposure."""
    return 1 < len(frame.exposure_times_s) == len(frame.channels)


def pattern_of(observed: Frame | Reference) -> Pattern:
    """Brightness patterns that distinguish the lights of an observation."""
    return pattern(observed.pixels, observed.full_scale)


def verify(observed: Frame | Reference, expected: Pattern | None, what: str) -> None:
    """Check that each exposure of an observation shows its own light.

    Parameters
    ----------
    observed : Frame or Reference
        One exposure per channel.
    expected : Pattern, optional
        Pattern of the undeformed sensor. Without it only dark and repeated exposures are found.
    what : str
        Name of the observation in the message.

    Raises
    ------
    SequenceError
        An exposure is dark, or shows another light than its own.
    """
    found = faults(pattern_of(observed), expected)
    if found:
        messages = "; ".join(_message(fault, observed.channels) for fault in found)
        raise SequenceError(
            f"{what}: {messages}, so it is not measured; record it again with the lights in order"
        )


def _message(fault: SequenceFault, names: tuple[str, ...]) -> str:
    name = names[fault.exposure]
    if fault.shows is None:
        return f"the exposure of light {name!r} is dark"
    if fault.certain:
        return f"the exposure of light {name!r} shows light {names[fault.shows]!r}"
    return f"the exposures of lights {names[fault.shows]!r} and {name!r} show the same light"


@dataclass(frozen=True, eq=False)
class Conditioning:
    """Verifies the sequence of a frame, masks its markers and compensates illumination drift.

    A pipeline and the fitting of a calibration share it, so that both use the same frames.

    Attributes
    ----------
    reference : Reference or None
        Image of the undeformed sensor, with its markers masked.
    finder : MarkerFinder or None
        None for a gel without markers.
    compensates : bool
        Whether illumination drift is compensated, which takes a reference.
    known : Reference or None
        Trusted reference whose exposures are in the correct order, such as that of the bundle.
        ``reference`` is verified against it.
    """

    reference: Reference | None
    finder: MarkerFinder | None = None
    compensates: bool = True
    known: Reference | None = None

    @classmethod
    def for_build(
        cls,
        build: GelImage,
        reference: Reference | None,
        *,
        compensates: bool,
        known: Reference | None = None,
    ) -> Self:
        """Make the conditioning of a sensor build, and mask the markers of the reference.

        Raises
        ------
        InputError
            The profile has ``markers: auto``, and there is no reference to detect them in.
        """
        finder = MarkerFinder.for_gel(build, reference)
        return cls(None, finder, compensates, known).with_reference(reference)

    def with_reference(self, reference: Reference | None) -> Self:
        """Return a copy with another reference."""
        if reference is not None and reference.marker_mask is None and self.finder is not None:
            reference = replace(reference, marker_mask=self.finder.find(reference.pixels))
        return replace(self, reference=reference)

    def __call__(self, frame: Frame) -> Frame:
        """Condition a frame.

        Raises
        ------
        SequenceError
            An exposure of a sequence is dark, or shows another light than its own.
        """
        self.verify(frame)
        return self.compensate_drift(self.mask_markers(frame))

    def verify(self, frame: Frame) -> None:
        """Check that each exposure of a sequential frame shows its own light."""
        if is_sequential(frame):
            verify(frame, self._expected, f"observation {frame.source or frame.sequence}")

    def mask_markers(self, frame: Frame) -> Frame:
        """Mask a frame's markers, unless they are masked already."""
        if self.finder is None or frame.marker_mask is not None:
            return frame
        return self.finder.mask_frame(frame)

    def compensate_drift(self, frame: Frame) -> Frame:
        """Measure the illumination drift of a masked frame, and compensate it if it should be."""
        if self._drift is None:
            return frame
        return self._drift.compensate_frame(frame)

    def condition_without(self, frame: Frame, hidden: Bool) -> Frame:
        """Condition a frame without using its hidden pixels, not even for the drift.

        The reference replaces them, as if nothing had touched there.

        Parameters
        ----------
        frame : Frame
        hidden : (H, W) bool
        """
        pixels = np.where(hidden[..., None], self.undeformed.pixels, frame.pixels)
        pixels = pixels.astype(frame.pixels.dtype)
        frame = self.mask_markers(
            replace(frame, pixels=pixels, marker_mask=None, marker_contrast=None)
        )
        unseen = hidden if frame.marker_mask is None else hidden | frame.marker_mask
        return replace(
            self.compensate_drift(replace(frame, marker_mask=unseen)), marker_mask=frame.marker_mask
        )

    @property
    def undeformed(self) -> Reference:
        """The reference; it is an error if there is none."""
        if self.reference is None:
            raise ValueError("there is no reference")
        return self.reference

    @cached_property
    def _expected(self) -> Pattern | None:
        if self.reference is None:
            return None
        known = None if self.known is None else pattern_of(self.known)
        verify(self.reference, known, "the reference")
        return known or pattern_of(self.reference)

    @cached_property
    def _drift(self) -> DriftCompensator | None:
        if self.reference is None:
            return None
        return DriftCompensator(self.reference, divides=self.compensates)
