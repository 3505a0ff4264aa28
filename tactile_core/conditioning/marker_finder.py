"""Finds the printed markers of a gel, whose size and pitch are known or detected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import UInt8
from tactile_core.algorithms.markers.contrast import (
    Tone,
    contrast_of,
    marker_mask,
    mask_of,
    reduction,
)
from tactile_core.algorithms.markers.count import expected_count, find_detectable_lattice, too_few
from tactile_core.algorithms.markers.detection import find_markers
from tactile_core.errors import InputError
from tactile_core.interfaces.component import GelImage
from tactile_core.interfaces.gel import Gel, Markers
from tactile_core.quantities import Bool, Frame, MarkerDetections, Pixels, Reference


@dataclass(frozen=True)
class MarkerFinder:
    """Finds printed markers of about ``diameter_px`` at a pitch of about ``pitch_px``.

    Attributes
    ----------
    tone : {"dark", "bright"}
    diameter_px, pitch_px : float
    count : int or None
        Number of markers in view, if the profile gives it.
    """

    tone: Tone
    diameter_px: float
    pitch_px: float
    count: int | None = None

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
            return cls(markers.tone, *sizes_px, markers.count)
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
        if self.count is not None:
            # [share] a lattice in part of the view has no other measure; some may be worn or hidden
            if abs(count - self.count) <= 0.1 * self.count:
                return ""
            return (
                f"the reference shows {count} {self.tone} markers, and the profile says "
                f"{self.count}; check that it is of this sensor and in focus, or correct "
                f"'gel.markers'"
            )
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
            count=self.count,
        )
        return gel.model_copy(update={"markers": markers})
