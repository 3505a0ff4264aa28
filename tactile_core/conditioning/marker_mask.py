"""Finds the printed markers of the profile's gel: which pixels show one, and where each is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tactile_core.algorithms.markers import (
    contrast_of,
    find_marker_diameter,
    find_markers,
    marker_mask,
    mask_of,
)
from tactile_core.errors import InputError
from tactile_core.interfaces.component import GelImage
from tactile_core.interfaces.gel import Gel, Markers
from tactile_core.quantities import Bool, Frame, MarkerDetections, Pixels, Reference


@dataclass(frozen=True)
class MarkerFinder:
    """Finds dark printed markers of about ``diameter_px``, about ``pitch_px`` apart."""

    diameter_px: float
    pitch_px: float

    @classmethod
    def of(cls, build: GelImage, reference: Reference | None = None) -> MarkerFinder | None:
        """Return the finder for a gel; None for a gel without markers.

        Raises
        ------
        InputError
            ``markers: auto`` and no reference to find them in.
        """
        markers, mm_per_px = build.gel.markers, build.image.mm_per_px
        if markers is None:
            return None
        if isinstance(markers, Markers):
            return cls(markers.diameter_mm / mm_per_px, markers.pitch_mm / mm_per_px)
        if reference is None:
            raise InputError(
                "'gel.markers: auto' needs a picture of the untouched gel to find them in; "
                "give --reference"
            )
        found = find_marker_diameter(np.asarray(reference.pixels))
        return None if found is None else cls(*found)

    def find(self, pixels: Pixels) -> Bool:
        """Return (H, W) bool: True on a marker and its rim."""
        return marker_mask(pixels, diameter_px=self.diameter_px)

    def marked(self, frame: Frame) -> Frame:
        """Return the frame with the pixels that show a marker, and the darkness that tells them."""
        marker_contrast = contrast_of(frame.pixels, diameter_px=self.diameter_px)
        marker_mask = mask_of(marker_contrast, frame.pixels.shape[:2])
        return replace(frame, marker_mask=marker_mask, marker_contrast=marker_contrast)

    def detect(self, frame: Frame | Reference, *, compiled: bool = False) -> MarkerDetections:
        """Return where each marker is; a frame that went through :meth:`marked` is quicker."""
        marker_contrast, timestamp_s = None, 0.0
        if isinstance(frame, Frame):
            marker_contrast, timestamp_s = frame.marker_contrast, frame.timestamp_s
        if marker_contrast is None:
            marker_contrast = contrast_of(frame.pixels, diameter_px=self.diameter_px)
        centres_px, cut = find_markers(
            marker_contrast,
            frame.pixels.shape[:2],
            diameter_px=self.diameter_px,
            pitch_px=self.pitch_px,
            compiled=compiled,
        )
        return MarkerDetections(centres_px, cut, timestamp_s)

    def told(self, gel: Gel, mm_per_px: float) -> Gel:
        """Return a gel that says what was found."""
        markers = Markers(
            pitch_mm=self.pitch_px * mm_per_px, diameter_mm=self.diameter_px * mm_per_px
        )
        return gel.model_copy(update={"markers": markers})
