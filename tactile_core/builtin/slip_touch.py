"""Where the object touches, as coarsely as ``core.slip`` needs it, and from what there is."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.gradient import steepness
from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.algorithms.slip.sheared_contact import Load
from tactile_core.algorithms.slip.touched import (
    contact_from_motion,
    contact_within_ring,
    covered,
    light_change,
    small_image,
)
from tactile_core.quantities import ContactMask, Frame, HeightMap, MarkerField, Reference

_SHEARED_MM = 0.04
_LEAST_SLOPE, _SURE_SLOPE, _STAYS = 0.03, 0.1, 0.5
_LEAST_CHANGE, _NOISES = 0.015, 5.0
_STRONGEST = 0.99
_CUT = 0.5
_MARKER_RADII = 1.6


class Touch(NamedTuple):
    """A contact at the coarse places, and how hard it is pressed.

    Attributes
    ----------
    mask : (h, w) bool
    load : Load
    blurred : bool
        Its border is one that the displacement field was made without.
    """

    mask: Bool
    load: Load
    blurred: bool = False


class TouchFinder:
    """Takes the contact from the height map, else from the image, else from the dragged skin.

    Parameters
    ----------
    stride : int
        Every so many pixels there is a coarse place.
    spacing_mm : float
        Distance of neighbouring places.
    marker_px : float
        Diameter of a marker; 0 where there are none.
    """

    def __init__(self, stride: int, spacing_mm: float, marker_px: float = 0.0) -> None:
        self.stride = stride
        self._spacing_mm = spacing_mm
        self._marker_radius = 0.5 * _MARKER_RADII * marker_px / stride
        self._undeformed: tuple[Reference, Float32] | None = None
        self.reset()

    def reset(self) -> None:
        """Forget every earlier contact."""
        self._measured_once = False
        self.release()

    def release(self) -> None:
        """Forget the present contact."""
        self._sheared: Bool | None = None
        self._slope = 0.0

    def picked(self, image: NDArray[Any]) -> NDArray[Any]:
        """Values at the coarse places of an image (H, W)."""
        first = self.stride // 2
        return image[first :: self.stride, first :: self.stride]

    def find(
        self,
        moved_mm: Float32,
        frame: Frame | None,
        reference: Reference | None,
        markers: MarkerField | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> Touch:
        """Find the contact; ``moved_mm`` (h, w) is how far the skin is displaced."""
        if contact is not None:
            found = self._measured(contact, height)
            if found.mask.any() or not self._fills_view(moved_mm):
                return found
        elif frame is not None and reference is not None and self._sheared is None:
            found = self._in_image(frame, reference, markers, moved_mm.shape)
            if found.mask.any() and _ends_within_view(found.mask):
                return found
        mask = contact_from_motion(moved_mm)
        if mask.any() and self._sheared is not None:
            # what lags behind when slip begins was dragged along before
            mask |= self._sheared
        self._sheared = mask if mask.any() else None
        return Touch(mask, Load(float(np.count_nonzero(mask)), 0.0))

    def _measured(self, contact: ContactMask, height: HeightMap | None) -> Touch:
        """What is steep tells more than what is high: beside wide or shallow contacts the skin is
        drawn down, and the mask of what is high misses a border or comes and goes."""
        mask = self.picked(contact.mask)
        load = Load(float(np.count_nonzero(contact.mask)), 0.0)
        if height is not None:
            steep = steepness(
                np.ascontiguousarray(self.picked(height.mm)), self._spacing_mm, smooth=True
            )
            slope = quantile(steep.ravel(), _STRONGEST)
            if mask.any() or slope > _SURE_SLOPE:
                self._slope = slope
            if self._slope and slope >= _STAYS * self._slope:
                within = contact_within_ring(steep, _LEAST_SLOPE)
                if within.any():
                    mask, load = within, Load(0.0, float(np.sqrt(steep.sum())))
        self._measured_once |= bool(mask.any())
        return Touch(mask, load)

    def _fills_view(self, moved_mm: Float32) -> bool:
        """A level object larger than the view has no slopes to be seen by, but drags the skin.

        So does what is left of a contact that has just ended.
        """
        return not self._measured_once and quantile(moved_mm.ravel(), 0.5) > _SHEARED_MM

    def _in_image(
        self,
        frame: Frame,
        reference: Reference,
        markers: MarkerField | None,
        shape: tuple[int, ...],
    ) -> Touch:
        size_px = shape[1], shape[0]
        if self._undeformed is None or self._undeformed[0] is not reference:
            small = small_image(reference.pixels, size_px, reference.full_scale)
            self._undeformed = reference, small
        now = small_image(frame.pixels, size_px, frame.full_scale)
        change = light_change(now, self._undeformed[1], self._hidden(markers, shape))
        least = max(_LEAST_CHANGE, _NOISES * reference.noise / reference.full_scale)
        # shear changes the light of a contact more than its volume
        load = Load(0.0, float(np.sqrt(change.sum())))
        return Touch(contact_within_ring(change, least), load, blurred=True)

    def _hidden(self, markers: MarkerField | None, shape: tuple[int, ...]) -> Bool:
        if markers is None:
            return np.zeros(shape, np.bool_)
        rest_px = markers.reference_px if markers.undeformed_px is None else markers.undeformed_px
        points_px = np.concatenate([rest_px, markers.px])
        return covered((points_px + 0.5) / self.stride - 0.5, self._marker_radius, shape)


def _ends_within_view(mask: Bool) -> bool:
    """A contact whose border is not seen is told better by the skin that it drags."""
    rim = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    return bool(rim.mean() < _CUT)
