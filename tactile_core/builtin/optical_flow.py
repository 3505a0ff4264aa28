"""The displacement of a skin without markers, from how the imprint of the object moves."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.displacement import flow
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import DisplacementField, Float32, Frame, Reference

_REACH_THICKNESSES = 0.5
_CHANGED_WEIGHT = 0.02


class OpticalFlow(Estimator):
    """Follows the imprint from picture to picture by dense inverse search.

    What is followed is what the object presses into the skin: it moves with the skin while the
    contact sticks, and with the object once it slips. The displacement is told since the imprint
    appeared, and is valid where there is something to follow: not under a smooth object.
    """

    class Options(device.Options):
        """Options of the step."""

        stride_px: PositiveFloat = Field(
            default=8.0,
            description="Motion, in pixels of the image, after which a new picture is followed.",
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        self._stride_px = options.stride_px
        self._undeformed: tuple[Reference, Float32] | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the imprint, so that the next frame's has not moved yet."""
        self._now: flow.Imprint | None = None
        self._key: flow.Imprint | None = None
        self._key_px = self._since_px = np.zeros((0, 0, 2), np.float32)

    def tare(self, result: DisplacementField) -> DisplacementField:
        """Measure from where the imprint is now."""
        self._key = self._now
        self._key_px = self._since_px = np.zeros_like(self._key_px)
        return replace(result, cells_mm=np.zeros_like(result.cells_mm))

    def estimate(self, frame: Frame, reference: Reference) -> DisplacementField:
        """Return the field; 0 far from everything that can be followed."""
        now = flow.imprint(flow.detail(frame.pixels, frame.full_scale), self._detail_of(reference))
        height, width = frame.pixels.shape[:2]
        factor = width / now.weight.shape[1]
        moved_px = self._followed(now, factor)
        size = (width, height)
        scale = np.float32(factor * frame.mm_per_px)
        weight = cv2.resize(now.weight, size, interpolation=cv2.INTER_LINEAR)
        return DisplacementField(
            moved_px * scale,
            np.asarray(weight > 0.5),
            frame.mm_per_px,
            frame.timestamp_s,
        )

    def _followed(self, now: flow.Imprint, factor: float) -> Float32:
        """Motion since the beginning, in pixels of the imprint."""
        key, self._now = self._key, now
        if key is None:
            self._key = now
            self._key_px = self._since_px = np.zeros((*now.weight.shape, 2), np.float32)
            return self._key_px
        thickness_mm = self.context.gel.thickness_mm or THICKNESS_MM
        reach_px = _REACH_THICKNESSES * thickness_mm / (factor * self.context.image.mm_per_px)
        both = np.minimum(key.weight, now.weight)
        since = flow.settled(flow.motion(key, now, self._since_px), both, reach_px=reach_px)
        moved = flow.settled(flow.composed(self._key_px, since), now.weight, reach_px=reach_px)
        self._since_px = since
        farthest = float(np.abs(since[both > 0.5]).max(initial=0.0))
        changed = float(np.abs(now.weight - key.weight).mean())
        if farthest * factor > self._stride_px or changed > _CHANGED_WEIGHT:
            self._key, self._key_px, self._since_px = now, moved, np.zeros_like(since)
        return moved

    def _detail_of(self, reference: Reference) -> Float32:
        kept = self._undeformed
        if kept is None or kept[0] is not reference:
            found = flow.detail(np.asarray(reference.pixels, np.float32), reference.full_scale)
            kept = self._undeformed = reference, found
        return kept[1]
