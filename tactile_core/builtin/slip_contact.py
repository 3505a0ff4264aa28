"""Estimator ``core.slip_contact``: the contact area in which slip is measured, and its load."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.shrinking import repeat_pixels
from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.algorithms.slip.plane import blocks, coarse_field, pick_pixels, stride_of
from tactile_core.algorithms.slip.shear_field import ContactLoad
from tactile_core.algorithms.slip.touched import (
    contact_from_motion,
    contact_within_ring,
    light_change,
    mask_squares,
    rim_share,
    small_image,
    steepness_of,
)
from tactile_core.conditioning.marker_finder import MarkerFinder
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    ContactMask,
    ContactSource,
    DisplacementField,
    Frame,
    HeightMap,
    MarkerField,
    Reference,
    SlipContact,
)
from tactile_core.quantities.quantity import Grid, grid_of, on_demand

# [share of the view's border] A contact that covers more of the border is taken from the
# displacement instead: chosen on virtual contacts (ADR 29)
_MAX_BORDER_SHARE = 0.5


class _Touch(NamedTuple):
    """A contact area on the coarse grid, its load, and what shows it."""

    mask: Bool
    load: ContactLoad
    source: ContactSource


class SlipContactFinder(Estimator):
    """Find the contact in the height map, else in the image, else in the displacement field."""

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._stride = stride_of(context.image.width_px)
        self._spacing_mm = self._stride * context.image.mm_per_px
        finder = None if context.gel.markers == "auto" else MarkerFinder.for_gel(context)
        marker_px = 0.0 if finder is None else finder.diameter_px
        # [marker diameters] with the blurred edge of a marker
        self._marker_radius = 0.8 * marker_px / self._stride
        self._undeformed: tuple[Reference, Float32] | None = None
        self.reset()

    def reset(self) -> None:
        """Forget all contacts."""
        self._measured_once = False
        self._release()

    def estimate(
        self,
        displacement: DisplacementField,
        frame: Frame | None,
        reference: Reference | None,
        markers: MarkerField | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> SlipContact:
        """Return the contact; its mask is empty without contact."""
        mask, load, source = self._find(displacement, frame, reference, markers, height, contact)
        if not np.count_nonzero(mask):
            self._release()
        # a first frame as reference may show a contact: then the load is not known
        absolute = reference is not None and not reference.relative
        shape = displacement.valid.shape[0], displacement.valid.shape[1]
        full = on_demand(
            lambda: repeat_pixels(mask.view(np.uint8), shape).view(np.bool_),
            Grid(mask, self._stride, shape),
        )
        return SlipContact(full, *load, source, absolute, displacement.timestamp_s)

    def _release(self) -> None:
        """Forget the present contact."""
        self._sheared: Bool | None = None

    def _find(
        self,
        displacement: DisplacementField,
        frame: Frame | None,
        reference: Reference | None,
        markers: MarkerField | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> _Touch:
        image_shape = displacement.valid.shape[0], displacement.valid.shape[1]
        if contact is not None:
            found = self._measure_touch(contact, height)
            if self._measured_once:  # a displacement is what remains of a measured contact
                return found
        elif frame is not None and reference is not None and self._sheared is None:
            shape = blocks(image_shape, self._stride)
            found = self._in_image(frame, reference, markers, shape)
            if found.mask.any() and rim_share(found.mask) < _MAX_BORDER_SHARE:
                return found
        moved_mm = np.abs(
            coarse_field(
                displacement.cells_mm,
                image_shape,
                self._stride,
            )
        )
        if contact is not None and not _fills_view(moved_mm):
            return found
        mask = contact_from_motion(moved_mm)
        if mask.any() and self._sheared is not None:
            # a part that lags behind once slip begins was sheared along before
            mask |= self._sheared
        self._sheared = mask if mask.any() else None
        source: ContactSource = "motion" if contact is None else "height"
        return _Touch(mask, ContactLoad(float(np.count_nonzero(mask)), 0.0), source)

    def _measure_touch(self, contact: ContactMask, height: HeightMap | None) -> _Touch:
        """The contact from slopes, else from its mask.

        Slopes are more reliable than heights. Around wide or shallow contacts the surface is drawn
        down, so the mask misses the border or flickers.
        """
        if height is not None:
            grid = grid_of(height, "mm")
            steep, slope = steepness_of(
                grid.cells,
                grid.step_px,
                grid.shape,
                self._stride,
                spacing_mm=self._spacing_mm,
            )
            # [slope] the height map alone shows a contact
            if slope > 0.1 or contact.mask.any():
                within = contact_within_ring(steep, 0.03, slope)  # [slope] at any border
                if np.count_nonzero(within):
                    self._measured_once = True
                    return _Touch(within, ContactLoad(0.0, math.sqrt(steep.sum())), "height")
        mask = pick_pixels(contact.mask, self._stride)
        self._measured_once |= bool(mask.any())
        return _Touch(mask, ContactLoad(float(np.count_nonzero(contact.mask)), 0.0), "height")

    def _in_image(
        self,
        frame: Frame,
        reference: Reference,
        markers: MarkerField | None,
        shape: tuple[int, ...],
    ) -> _Touch:
        size_px = shape[1], shape[0]
        if self._undeformed is None or self._undeformed[0] is not reference:
            small = small_image(reference.pixels, size_px, reference.full_scale)
            self._undeformed = reference, small
        now = small_image(frame.pixels, size_px, frame.full_scale)
        change = light_change(now, self._undeformed[1], self._mask_markers(markers, shape))
        # [share of the full scale; noise sigmas] the change of light at any border
        least = max(0.015, 5.0 * reference.noise / reference.full_scale)
        # shear changes the light of a contact by more than its volume
        load = ContactLoad(0.0, math.sqrt(change.sum()))
        mask = contact_within_ring(change, least)
        return _Touch(mask, load, "image")

    def _mask_markers(self, markers: MarkerField | None, shape: tuple[int, ...]) -> Bool:
        if markers is None:
            return np.zeros(shape, np.bool_)
        undeformed_px = (
            markers.reference_px if markers.undeformed_px is None else markers.undeformed_px
        )
        points_px = np.concatenate([undeformed_px, markers.px])
        return mask_squares((points_px + 0.5) / self._stride - 0.5, self._marker_radius, shape)


def _fills_view(moved_mm: Float32) -> bool:
    """Whether an object larger than the view, which has no visible border, shears the surface."""
    # [mm] an object without visible border fills the view
    return quantile(moved_mm.ravel(), 0.5) > 0.04
