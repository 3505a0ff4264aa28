"""Estimator ``core.optical_flow``: displacement without markers, from the object's imprint."""

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


class OPTICAL_FLOW:
    """Parameters of the step; the pixel stride is an option."""

    # [gel thicknesses] Standard deviation of the Gaussian that extrapolates the motion around the
    # imprint. Source: by hand, a bonded layer decays within about one thickness.
    reach_thicknesses = 0.5
    # [share of the image] Mean change of the texture weight after which a new key frame is taken.
    changed_weight = 0.02


class OpticalFlow(Estimator):
    """Track the imprint of the object by dense optical flow between key frames.

    The imprint moves with the gel surface while the contact sticks, and with the object once it
    slips. The displacement starts at 0 when the imprint appears. It is valid only where there is
    texture, so not under a smooth object. The method is
    :func:`tactile_core.algorithms.displacement.flow.motion`.
    """

    class Options(device.Options):
        """Options of the step."""

        stride_px: PositiveFloat = Field(
            default=8.0,
            description="Motion after which a new key frame is taken, in pixels of the image.",
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        self._stride_px = options.stride_px
        self._undeformed: tuple[Reference, Float32] | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the imprint; the displacement starts at 0 with the next frame."""
        self._now: flow.Imprint | None = None
        self._key: flow.Imprint | None = None
        self._key_px = self._since_px = np.zeros((0, 0, 2), np.float32)

    def tare(self, result: DisplacementField) -> DisplacementField:
        """Measure displacements from the present position of the imprint."""
        self._key = self._now
        self._key_px = self._since_px = np.zeros_like(self._key_px)
        return replace(result, cells_mm=np.zeros_like(result.cells_mm))

    def estimate(self, frame: Frame, reference: Reference) -> DisplacementField:
        """Return the field; it is 0 far from any texture."""
        now = flow.imprint(flow.detail(frame.pixels, frame.full_scale), self._detail_of(reference))
        height, width = frame.pixels.shape[:2]
        factor = width / now.weight.shape[1]
        moved_px = self._motion_px(now, factor)
        size = (width, height)
        scale = np.float32(factor * frame.mm_per_px)
        weight = cv2.resize(now.weight, size, interpolation=cv2.INTER_LINEAR)
        return DisplacementField(
            moved_px * scale,
            np.asarray(weight > 0.5),
            frame.mm_per_px,
            frame.timestamp_s,
        )

    def _motion_px(self, now: flow.Imprint, factor: float) -> Float32:
        """Displacement since the imprint appeared, in pixels of the imprint."""
        key, self._now = self._key, now
        if key is None:
            self._key = now
            self._key_px = self._since_px = np.zeros((*now.weight.shape, 2), np.float32)
            return self._key_px
        thickness_mm = self.context.gel.thickness_mm or THICKNESS_MM
        reach_px = (
            OPTICAL_FLOW.reach_thicknesses * thickness_mm / (factor * self.context.image.mm_per_px)
        )
        both = np.minimum(key.weight, now.weight)
        since = flow.fill_untextured(flow.motion(key, now, self._since_px), both, reach_px=reach_px)
        moved = flow.fill_untextured(
            flow.compose_motions(self._key_px, since), now.weight, reach_px=reach_px
        )
        self._since_px = since
        farthest = float(np.abs(since[both > 0.5]).max(initial=0.0))
        changed = float(np.abs(now.weight - key.weight).mean())
        if farthest * factor > self._stride_px or changed > OPTICAL_FLOW.changed_weight:
            self._key, self._key_px, self._since_px = now, moved, np.zeros_like(since)
        return moved

    def _detail_of(self, reference: Reference) -> Float32:
        kept = self._undeformed
        if kept is None or kept[0] is not reference:
            found = flow.detail(np.asarray(reference.pixels, np.float32), reference.full_scale)
            kept = self._undeformed = reference, found
        return kept[1]
