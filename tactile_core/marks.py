"""Finds the pixels that show a printed marker, as the profile's gel says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.errors import InputError
from tactile_core.profiles.model import Markers, Profile
from tactile_core.quantities import Bool, Pixels, Reference


@dataclass(frozen=True)
class MarkFinder:
    """Masks dark printed dots of about ``diameter_px``."""

    diameter_px: float

    @classmethod
    def of(cls, profile: Profile, reference: Reference | None = None) -> MarkFinder | None:
        """Return the finder for a profile's gel; None for a gel without marks.

        Raises
        ------
        InputError
            ``markers: auto`` and no reference to find them in.
        """
        markers = profile.gel.markers
        if markers is None:
            return None
        if isinstance(markers, Markers):
            return cls(markers.diameter_mm / profile.image.mm_per_px)
        if reference is None:
            raise InputError(
                "'gel.markers: auto' needs a picture of the untouched gel to find them in; "
                "give --reference"
            )
        from tactile_core.algorithms.markers import find_marker_diameter

        found = find_marker_diameter(np.asarray(reference.pixels))
        return None if found is None else cls(found[0])

    def find(self, pixels: Pixels) -> Bool:
        """Return (H, W) bool: True on a mark and its rim."""
        from tactile_core.algorithms.markers import marker_mask

        return marker_mask(pixels, diameter_px=self.diameter_px)
