"""``baxter_fingertip.hue_intensity``: yaw from hue, pitch from saturation and intensity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field

from tactile_baxter_fingertip.hue_correction import HueCorrection, fit_correction
from tactile_baxter_fingertip.hue_decoder import HueDecoder, PitchFrom, fit_decoder
from tactile_baxter_fingertip.hue_field import HueField, ReferenceLight
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Calibrator, Press
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.for_reference import ForReference
from tactile_core.interfaces.slope_models.model_file import arrays_of, stored_model, write_model
from tactile_core.interfaces.slope_models.samples import (
    ImageShape,
    check_fitting,
    draw_samples,
    in_words,
    scale_of,
    shape_of,
    too_few,
)
from tactile_core.interfaces.slope_models.slope_model import slopes_of
from tactile_core.quantities import Bool, Frame, Gradients, Reference

CHANNELS = 3  # Hue needs three channels


_FEWEST = 500  # [count] Sloped pixels that a fit needs at least
# [count] Training pixels of all presses together, at most. Dense tables need more than a regression
_MOST = 200_000
_SURVEYED = 5  # [count] Calibration frames whose share of sloped pixels is averaged, about
# [share] A press with a smaller share of sloped training pixels has level gel around it: single
# presses have 0.8, by the share of undeformed pixels (``calibration/presses.py``), and grids 1 but
# for the tops of balls
_SLOPED_SHARE = 0.95


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
    pitch_from: PitchFrom = Field(
        default="both",
        description="Source of the pitch: intensity as in the paper, saturation, or both, weighted "
        "by their precision.",
    )


class HueIntensity(Calibration):
    """A fitted decoder and its correction; see ``hue_decoder`` and ``hue_correction``."""

    def __init__(
        self,
        decoder: HueDecoder,
        correction: HueCorrection,
        shape: ImageShape,
        blur_px: float,
        light_blur_px: float,
    ) -> None:
        self.decoder, self.correction, self._shape = decoder, correction, shape
        self._blur_px, self._light_blur_px = blur_px, light_blur_px
        self._field = ForReference(self.field)

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of one frame.

        They are valid where no marker hides the gel surface, no channel is saturated and at most
        one is dark.

        Raises
        ------
        CalibrationError
            The size of the frame or the reference differs from that of the presses, or the full
            scales of frame and reference differ.
        """
        check_fitting(frame, reference, self._shape)
        cells = self._field(reference).measure(frame.pixels, frame.marker_mask)
        return slopes_of(frame, cells, lambda: _has_hue(frame))

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        blurs_px = np.array([self._blur_px, self._light_blur_px])
        arrays = {"blurs_px": blurs_px, **arrays_of(self.decoder), **self.correction.arrays()}
        write_model(directory, self._shape, arrays, compressed=True)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            The file is missing, damaged or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            blur_px, light_blur_px = (float(b) for b in arrays["blurs_px"])
            decoder = HueDecoder.from_arrays(arrays)
            correction = HueCorrection.from_arrays(arrays)
        return cls(decoder, correction, shape, blur_px, light_blur_px)

    def field(self, reference: Reference) -> HueField:
        """Prepare the model for one reference."""
        light = _light(reference, self._blur_px, self._light_blur_px)
        return HueField(self.decoder, self.correction, light)


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
        light = _light(reference, blur_px, light_blur_px)
        for press in presses:
            if press.frame.pixels.shape != reference.pixels.shape:
                raise CalibrationError(
                    f"the calibration belongs to images of {in_words(reference.pixels.shape)} and "
                    f"press {press.name!r} is {in_words(press.frame.pixels.shape)}; calibrate at "
                    f"the size of the input"
                )
        features, normal_xy = draw_samples(presses, light.features, most=_MOST)
        if np.count_nonzero(normal_xy.any(axis=1)) < _FEWEST:
            raise too_few(presses)
        decoder = fit_decoder(features, normal_xy, self.options.pitch_from)
        correction = fit_correction(decoder, features, normal_xy, by_place=_is_crowded(presses))
        field = HueIntensity(decoder, correction, shape, blur_px, light_blur_px).field(reference)
        correction = replace(correction, steep_share=_steep_share(field, presses))
        return HueIntensity(decoder, correction, shape, blur_px, light_blur_px)

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return the smoothing of the options in px."""
        return self.options.blur_mm / mm_per_px


def _light(reference: Reference, blur_px: float, light_blur_px: float) -> ReferenceLight:
    return ReferenceLight(
        reference.pixels,
        reference.marker_mask,
        full_scale=reference.full_scale,
        blur_px=blur_px,
        light_blur_px=light_blur_px,
    )


def _is_crowded(presses: Sequence[Press]) -> bool:
    """Whether the presses leave no level gel between them, as a grid of balls does."""
    sloped = [press.gradients.any(axis=1).mean() for press in presses if press.gradients.any()]
    return bool(min(sloped) > _SLOPED_SHARE)


def _steep_share(field: HueField, presses: Sequence[Press]) -> float:
    """Return the mean share of sloped pixels over some calibration frames."""
    pressed = {id(press.frame): press.frame for press in presses if press.gradients.any()}
    frames = list(pressed.values())
    some = frames[:: max(1, len(frames) // _SURVEYED)]
    return float(np.mean([field.steep_share(frame.pixels, frame.marker_mask) for frame in some]))


def _has_hue(frame: Frame) -> Bool:
    """Whether no channel of a pixel is saturated, (H, W) bool: the others do not give its hue."""
    return np.asarray(~frame.saturated.any(axis=2))
