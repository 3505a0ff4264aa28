"""``core.optical_flow`` and ``core.contact_shear``: displacement without markers, and its shear."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.arrays.types import Bool, Complex64
from tactile_core.algorithms.displacement import flow
from tactile_core.algorithms.force.elastic_layer import THICKNESS_MM
from tactile_core.algorithms.slip.imprint import VIEW
from tactile_core.algorithms.slip.plane import coarse_field, pick_pixels, stride_of
from tactile_core.algorithms.slip.shear_field import (
    SHEAR_FIELD,
    ContactLoad,
    ShearedContact,
)
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    ContactShear,
    DisplacementField,
    Float32,
    Frame,
    MarkerField,
    Reference,
    SlipContact,
)
from tactile_core.quantities.quantity import grid_of


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
        self._now: flow.TextureImprint | None = None
        self._key: flow.TextureImprint | None = None
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

    def _motion_px(self, now: flow.TextureImprint, factor: float) -> Float32:
        """Displacement since the imprint appeared, in pixels of the imprint."""
        key, self._now = self._key, now
        if key is None:
            self._key = now
            self._key_px = self._since_px = np.zeros((*now.weight.shape, 2), np.float32)
            return self._key_px
        thickness_mm = self.context.gel.thickness_mm or THICKNESS_MM
        # [thicknesses] A bonded layer decays within about one
        reach_px = 0.5 * thickness_mm / (factor * self.context.image.mm_per_px)
        both = np.minimum(key.weight, now.weight)
        since = flow.fill_untextured(flow.motion(key, now, self._since_px), both, reach_px=reach_px)
        moved = flow.fill_untextured(
            flow.compose_motions(self._key_px, since), now.weight, reach_px=reach_px
        )
        self._since_px = since
        farthest = float(np.abs(since[both > 0.5]).max(initial=0.0))
        changed = float(np.abs(now.weight - key.weight).mean())
        # [share of the image] Mean change of the texture's weight
        if farthest * factor > self._stride_px or changed > 0.02:
            self._key, self._key_px, self._since_px = now, moved, np.zeros_like(since)
        return moved

    def _detail_of(self, reference: Reference) -> Float32:
        kept = self._undeformed
        if kept is None or kept[0] is not reference:
            found = flow.detail(np.asarray(reference.pixels, np.float32), reference.full_scale)
            kept = self._undeformed = reference, found
        return kept[1]


class _Observation(NamedTuple):
    """The contact in one frame."""

    field: Complex64
    mask: Bool
    load: ContactLoad
    time_s: float


class ShearOfContact(Estimator):
    """Measure the shear of the contact in the displacement field, and the share that slips.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    class Options(device.Options):
        """Options of the step."""

        window_mm: PositiveFloat = Field(
            default=SHEAR_FIELD.window_mm,
            description="Motion of the contact over which slip is measured, in mm.",
        )
        noise_mm: PositiveFloat = Field(
            default=SHEAR_FIELD.noise_mm,
            description="Noise of a displacement along x or y, in mm: a point that lags behind the "
            "others by 4 times as much slips.",
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        chosen = self.Options.model_validate(options.model_dump())
        self._stride = stride_of(context.image.width_px)
        self._contact = ShearedContact(
            self._stride * context.image.mm_per_px,
            window_mm=chosen.window_mm,
            noise_mm=chosen.noise_mm,
        )
        self.reset()

    def reset(self) -> None:
        """Forget the contact."""
        self._contact.release()
        self._last: _Observation | None = None

    def tare(self, result: ContactShear) -> ContactShear:
        """Measure from the present frame on."""
        self._contact.release()
        return result if self._last is None else self._measure_shear(self._last)

    def estimate(
        self, contact: SlipContact, displacement: DisplacementField, markers: MarkerField | None
    ) -> ContactShear:
        """Return the shear; without contact only whether the field is usable."""
        time_s, valid = displacement.timestamp_s, pick_pixels(displacement.valid, self._stride)
        few = markers is not None and np.count_nonzero(markers.seen) < VIEW.min_markers
        if few or not valid.any():
            self.reset()
            return ContactShear(False, timestamp_s=time_s)
        grid = grid_of(contact, "mask")
        # that of the step before has a grid of this stride
        mask = (
            grid.cells if grid.step_px == self._stride else pick_pixels(contact.mask, self._stride)
        )
        if not np.count_nonzero(mask):
            self.reset()
            return ContactShear(True, timestamp_s=time_s)
        measured = mask & valid
        self._last = _Observation(
            coarse_field(displacement.cells_mm, displacement.valid.shape, self._stride),
            measured if np.count_nonzero(measured) >= 12 else mask,  # [points]
            ContactLoad(contact.area, contact.depth),
            time_s,
        )
        return self._measure_shear(self._last)

    def _measure_shear(self, now: _Observation) -> ContactShear:
        shear = self._contact.update(now.field, now.mask, now.load)
        return ContactShear(
            True,
            shear.stick_share,
            shear.motion_mm,
            shear.rotation_mm,
            math.degrees(shear.rotation_rad),
            shear.entropy_bits,
            self._contact.restarted,
            now.time_s,
        )
