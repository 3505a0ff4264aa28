"""``baxter_fingertip.hue_intensity``: yaw from hue, pitch from saturation and intensity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from tactile_baxter_fingertip.hue_decoder import HueDecoder, fit_decoder
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibrator, Press
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.slope_models.samples import (
    is_grid,
    press_light_of,
    samples_of,
    scale_of,
    shape_of,
    without_grain,
)
from tactile_core.interfaces.slope_models.slope_model import SlopeCalibration, SlopeModel
from tactile_core.quantities import Frame, Gradients, Reference

CHANNELS = 3  # Hue needs three channels


class HueIntensityOptions(Options):
    """Options of ``baxter_fingertip.hue_intensity``."""

    blur_mm: float = Field(
        default=0.027,
        ge=0,
        le=1,
        description="Gaussian smoothing against the grain of the coating: standard deviation, mm.",
    )
    light_blur_mm: float = Field(
        default=0.11,
        ge=0,
        le=10,
        description="Additional smoothing of the reference, whose grain differs from that under a "
        "press: standard deviation, mm.",
    )


class HueIntensity(SlopeCalibration):
    """Calibration with a fitted decoder of hue, saturation and intensity."""

    function = HueDecoder

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of one frame; see :meth:`SlopeModel.measure`."""
        return self.slopes.measure(_in_floats(frame), reference)


class HueIntensityCalibrator(Calibrator):
    """Fits a decoder of colour: yaw from hue, pitch from saturation and intensity.

    References
    ----------
    .. [1] R. Li, R. Platt, W. Yuan, A. ten Pas, N. Roscup, M. A. Srinivasan and E. H. Adelson,
       "Localization and Manipulation of Small Parts Using GelSight Tactile Sensing", IROS, 2014.
    .. [2] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
       Estimating Geometry and Force", Sensors 17(12), 2017, section 4.2.
    """

    Options: ClassVar[type[BaseModel]] = HueIntensityOptions
    options: HueIntensityOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> HueIntensity:
        """Fit to presses of a ball or another calibration target.

        Raises
        ------
        CalibrationError
            The images do not have three channels, the presses differ in size from the reference,
            or too few pixels are sloped.
        """
        shape = shape_of(reference)
        if shape[2] != CHANNELS:
            raise CalibrationError(
                f"baxter_fingertip.hue_intensity needs three channels and the frames have "
                f"{shape[2]}; use core.mlp or core.polynomial"
            )
        scale = scale_of(presses)
        blur_px, light_blur_px = self.options.blur_mm / scale, self.options.light_blur_mm / scale
        light = without_grain(reference, light_blur_px)
        pressed = [replace(press, frame=_in_floats(press.frame)) for press in presses]
        features, normal_xy = samples_of(pressed, light, blur_px=blur_px)
        decoder, tilt = fit_decoder(features, normal_xy, by_place=is_grid(presses))
        press_light = press_light_of(tilt, presses)
        return HueIntensity(SlopeModel(decoder, shape, blur_px, None, light_blur_px, press_light))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return the smoothing of the options in px."""
        return self.options.blur_mm / mm_per_px


def _in_floats(frame: Frame) -> Frame:
    """Return a frame whose smoothing is not rounded to grey levels, which doubles its noise."""
    return replace(frame, pixels=frame.pixels.astype(np.float32))
