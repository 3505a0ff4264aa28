"""Where the object touches, as coarsely as ``core.slip`` needs it, and from what there is."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.quantile import quantile
from tactile_core.algorithms.slip.drag import Load
from tactile_core.algorithms.slip.touched import small_image, touched_by_image, touched_by_motion
from tactile_core.quantities import ContactMask, Frame, HeightMap, Reference

Bool = NDArray[np.bool_]

_DRAGGED_MM = 0.04
_STAYS, _RAISED_MM = 0.5, 0.06
_CUT = 0.1


class Touch(NamedTuple):
    """A contact at the coarse places, and how hard it is pressed.

    Attributes
    ----------
    mask : (h, w) bool
    load : Load
    """

    mask: Bool
    load: Load


class TouchFinder:
    """Takes the contact from the height map, else from the image, else from the dragged skin.

    Parameters
    ----------
    stride : int
        Every so many pixels there is a coarse place.
    reference : Reference or None
        The untouched sensor.
    """

    def __init__(self, stride: int, reference: Reference | None) -> None:
        self.stride = stride
        self._reference = reference
        self._untouched: NDArray[np.float32] | None = None
        self.reset()

    def reset(self) -> None:
        """Forget every earlier contact."""
        self._measured_once = False
        self.release()

    def release(self) -> None:
        """Forget the present contact."""
        self._dragged: Bool | None = None
        self._held: Touch | None = None
        self._held_mm = 0.0

    def picked(self, image: NDArray[Any]) -> NDArray[Any]:
        """Values at the coarse places of an image (H, W)."""
        first = self.stride // 2
        return image[first :: self.stride, first :: self.stride]

    def find(
        self,
        moved_mm: NDArray[np.float32],
        frame: Frame | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> Touch:
        """Find the contact; ``moved_mm`` (h, w) is how far the skin is displaced."""
        if contact is not None:
            found = self._measured(contact, frame, height)
            if found.mask.any() or not self._fills_view(moved_mm):
                return found
        if frame is not None and self._reference is not None:
            found = self._in_image(frame, self._reference, moved_mm.shape)
            if found.mask.any() and (
                contact is None or (self._dragged is None and _ends_within_view(found.mask))
            ):
                return found
        mask = touched_by_motion(moved_mm)
        if mask.any() and self._dragged is not None:
            # what lags behind when slip begins was dragged along before
            mask |= self._dragged
        self._dragged = mask if mask.any() else None
        return Touch(mask, Load(float(np.count_nonzero(mask)), 0.0))

    def _measured(
        self, contact: ContactMask, frame: Frame | None, height: HeightMap | None
    ) -> Touch:
        mask = self.picked(contact.mask)
        area_px = float(np.count_nonzero(contact.mask))
        if mask.any():
            self._measured_once = True
        if height is None:
            return Touch(mask, Load(area_px, 0.0))
        height_mm = self.picked(height.mm)
        if mask.any():
            return self._hold(mask, area_px, height_mm)
        return self._still_raised(height_mm, frame) or Touch(mask, Load(0.0, 0.0))

    def _hold(self, mask: Bool, area_px: float, height_mm: NDArray[np.float32]) -> Touch:
        raised_mm = height_mm[mask]
        total_mm = float(raised_mm.sum())
        self._held = Touch(mask, Load(area_px, total_mm))
        self._held_mm = total_mm / len(raised_mm)
        return self._held

    def _still_raised(self, height_mm: NDArray[np.float32], frame: Frame | None) -> Touch | None:
        """A contact that the mask misses: beside wide or shallow ones the skin is drawn down, as
        far as noise might reach, and the mask comes and goes."""
        mask = np.zeros(height_mm.shape, np.bool_)
        if frame is not None and self._reference is not None:
            mask = self._in_image(frame, self._reference, height_mm.shape).mask
        if self._held is not None:
            before = self._held.mask
            if height_mm[before].mean() > _STAYS * self._held_mm or mask[before].mean() > _STAYS:
                return self._held
            self._held = None
        elif mask.any() and height_mm[mask].mean() > _RAISED_MM:
            area_px = float(np.count_nonzero(mask)) * self.stride**2
            return self._hold(mask, area_px, height_mm)
        return None

    def _fills_view(self, moved_mm: NDArray[np.float32]) -> bool:
        """A level object larger than the view has no slopes to be seen by, but drags the skin.

        So does what is left of a contact that has just ended.
        """
        return not self._measured_once and quantile(moved_mm.ravel(), 0.5) > _DRAGGED_MM

    def _in_image(self, frame: Frame, reference: Reference, shape: tuple[int, ...]) -> Touch:
        size_px = shape[1], shape[0]
        if self._untouched is None:
            self._untouched = small_image(reference.pixels, size_px, reference.full_scale)
        now = small_image(frame.pixels, size_px, frame.full_scale)
        noise = reference.noise / reference.full_scale
        mask, strength = touched_by_image(now, self._untouched, noise)
        # shear changes the light of a contact more than its volume
        return Touch(mask, Load(0.0, float(np.sqrt(strength))))


def _ends_within_view(mask: Bool) -> bool:
    """A contact whose border is not seen is told better by the skin that it drags."""
    rim = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    return bool(rim.mean() < _CUT)
