"""``baxter_fingertip.hue_intensity``: yaw from hue and saturation, pitch from intensity."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Self

import cv2
import numpy as np
from pydantic import BaseModel, Field

from tactile_baxter_fingertip.hue_decoder import HueDecoder, PitchFrom, fit_decoder
from tactile_baxter_fingertip.hue_field import HueField, ReferenceLight
from tactile_core.algorithms.levels import LEVELS
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Calibrator, Press
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.slope_models.for_reference import ForReference
from tactile_core.interfaces.slope_models.image_shape import (
    ImageShape,
    check_fitting,
    in_words,
    shape_of,
)
from tactile_core.interfaces.slope_models.model_file import arrays_of, stored_model, write_model
from tactile_core.interfaces.slope_models.samples import scale_of, thinned, too_few
from tactile_core.quantities import Bool, Frame, Gradients, Reference

FEWEST_SAMPLES = 500
MOST_SAMPLES = 200_000
CHANNELS = 3


class HueIntensityOptions(Options):
    """Options of ``baxter_fingertip.hue_intensity``."""

    blur_mm: float = Field(
        default=0.027,
        ge=0,
        le=1,
        description="Smoothing against the grain of the coating, standard deviation.",
    )
    light_blur_mm: float = Field(
        default=0.11,
        ge=0,
        le=10,
        description="Smoothing of the reference, whose grain is not that under a press.",
    )
    pitch_from: PitchFrom = Field(
        default="both",
        description="What tells the pitch beside the yaw: intensity as in the paper, or saturation,"
        " or both, each where it is sure.",
    )


class HueIntensity(Calibration):
    """A fitted decoder; see ``hue_decoder``."""

    def __init__(
        self,
        decoder: HueDecoder,
        shape: ImageShape,
        blur_px: float,
        light_blur_px: float,
    ) -> None:
        self.decoder, self._shape = decoder, shape
        self._blur_px, self._light_blur_px = blur_px, light_blur_px
        self._field = ForReference(self._prepared)

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Slopes of one frame; not valid where marked, saturated in a channel, or dark in all.

        Raises
        ------
        CalibrationError
            The frame or the reference has another size than the presses had, or they have another
            full scale than each other.
        """
        check_fitting(frame, reference, self._shape)
        gx, gy = self._field(reference).measure(frame.pixels, frame.marker_mask)
        return Gradients(gx, gy, _valid(frame), frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        blurs_px = np.array([self._blur_px, self._light_blur_px])
        arrays = {"blurs_px": blurs_px, **arrays_of(self.decoder)}
        write_model(directory, self._shape, arrays, compressed=True)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            It is missing, broken or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            blur_px, light_blur_px = (float(b) for b in arrays["blurs_px"])
            decoder = HueDecoder.from_arrays(arrays)
        return cls(decoder, shape, blur_px, light_blur_px)

    def _prepared(self, reference: Reference) -> HueField:
        return HueField(self.decoder, _light(reference, self._blur_px, self._light_blur_px))


class HueIntensityCalibrator(Calibrator):
    """The way of the first fingertip with four colours: yaw by hue, pitch by intensity."""

    Options: ClassVar[type[BaseModel]] = HueIntensityOptions
    options: HueIntensityOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> HueIntensity:
        """Fit on presses of a known ball.

        Raises
        ------
        CalibrationError
            The images do not have three channels or the presses' size, or too few pixels slope.
        """
        shape = shape_of(reference)
        if shape[2] != CHANNELS:
            raise CalibrationError(
                f"baxter_fingertip.hue_intensity reads hue from three channels and the frames have "
                f"{shape[2]}; use core.mlp or core.polynomial"
            )
        scale = scale_of(presses)
        blur_px, light_blur_px = self.options.blur_mm / scale, self.options.light_blur_mm / scale
        light = _light(reference, blur_px, light_blur_px)
        for press in presses:
            if press.frame.pixels.shape != reference.pixels.shape:
                raise CalibrationError(
                    f"the calibration belongs to images of {in_words(reference.pixels.shape)} and "
                    f"press {press.name!r} is {in_words(press.frame.pixels.shape)}; calibrate at "
                    f"the size of the input"
                )
        features, normal_xy = thinned(presses, light.features, most=MOST_SAMPLES)
        if np.count_nonzero(normal_xy.any(axis=1)) < FEWEST_SAMPLES:
            raise too_few(presses)
        decoder = fit_decoder(features, normal_xy, self.options.pitch_from)
        return HueIntensity(decoder, shape, blur_px, light_blur_px)

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing that the options ask for."""
        return self.options.blur_mm / mm_per_px


def _light(reference: Reference, blur_px: float, light_blur_px: float) -> ReferenceLight:
    return ReferenceLight(
        reference.pixels,
        reference.marker_mask,
        full_scale=reference.full_scale,
        blur_px=blur_px,
        light_blur_px=light_blur_px,
    )


def _valid(frame: Frame) -> Bool:
    """A saturated channel bends the hue, so that all three must be below; darkness has none."""
    valid: Bool = np.ones(frame.pixels.shape[:2], np.bool_)
    # Extremes are found ten times faster than where they are, and are rarely out of range.
    darkest, brightest, *_ = cv2.minMaxLoc(frame.pixels.reshape(len(frame.pixels), -1))
    if brightest >= LEVELS.saturation_share * frame.full_scale:
        valid &= ~frame.saturated.any(axis=2)
    if darkest <= LEVELS.dark_share * frame.full_scale:
        valid &= (frame.pixels > LEVELS.dark_share * frame.full_scale).any(axis=2)
    if frame.marker_mask is not None:
        valid &= ~frame.marker_mask
    return valid
