"""``desktop_six_led.photometric_stereo``: slopes from lamps that shine one after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration, Compensation
from tactile_core.interfaces.calibrator import Calibrator, Press
from tactile_core.interfaces.illumination import Light
from tactile_core.interfaces.slope_models.for_reference import ForReference
from tactile_core.interfaces.slope_models.image_shape import ImageShape, check_fitting, shape_of
from tactile_core.interfaces.slope_models.model_file import (
    arrays_of,
    blur_from,
    part_from,
    stored_model,
    write_model,
)
from tactile_core.interfaces.slope_models.options import SlopeOptions
from tactile_core.interfaces.slope_models.samples import samples_of, scale_of
from tactile_core.interfaces.slope_models.slope_model import slopes_of
from tactile_core.quantities import Float32, Frame, Gradients, Reference
from tactile_desktop_six_led.given_lights import GivenLights, light_directions
from tactile_desktop_six_led.light_drift import LightDrift, fit_light_drift
from tactile_desktop_six_led.light_field import LightField
from tactile_desktop_six_led.light_fit import fit_light_field
from tactile_desktop_six_led.redundancy import Redundancy, fit_redundancy
from tactile_desktop_six_led.stereo_field import StereoField

FEWEST_LIGHTS = 3
_FRAMES = 5


@dataclass(frozen=True, eq=False)
class StereoModel:
    """A light field, what its lamps say in common, and how their drift is told."""

    field: LightField
    redundancy: Redundancy
    drift: LightDrift

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All that was fitted, by name."""
        return arrays_of(self.field) | arrays_of(self.redundancy) | arrays_of(self.drift)


class StereoOptions(SlopeOptions):
    """Options of ``desktop_six_led.photometric_stereo``."""

    lights: Literal["learned", "given"] = Field(
        default="learned",
        description="given: measure with no bundle, with the lights where the profile has them.",
    )


class PhotometricStereo(Calibration):
    """Light that varies over the image, each light's own response, shadows and highlights rejected.

    Any three lights or more; from five on, a light that a shadow or a highlight spoils is replaced
    by what the others predict, from six on two of them; drift of a light is inferred from the
    others, too. Steeper slopes than were pressed are read by the same law, so that it extrapolates
    where a regression levels off.
    """

    compensation: ClassVar[Compensation] = "none"

    def __init__(
        self, model: StereoModel, shape: ImageShape, blur_px: float, *, compiled: bool = False
    ) -> None:
        self._model, self._shape, self._blur_px = model, shape, blur_px
        self._compiled = compiled
        self._field = ForReference(self.field)

    def prepared(self, *, compiled: bool) -> Self:
        """Return the model with or without compiled loops."""
        return type(self)(self._model, self._shape, self._blur_px, compiled=compiled)

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Slopes of one frame; valid where the lights agree on them, too.

        Raises
        ------
        CalibrationError
            The frame or the reference has another size or number of channels than the presses had,
            or they have another full scale than each other.
        """
        check_fitting(frame, reference, self._shape)
        gx, gy, agreed = self._field(reference).measure(frame.pixels, frame.marker_mask)
        return slopes_of(frame, gx, gy, agreed)

    def field(self, reference: Reference) -> StereoField:
        """Prepare the model for one reference."""
        return StereoField(
            self._model.field,
            self._model.redundancy,
            self._model.drift,
            reference.pixels,
            reference.marker_mask,
            full_scale=reference.full_scale,
            blur_px=self._blur_px,
            compiled=self._compiled,
        )

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        write_model(
            directory, self._shape, {"blur_px": np.array(self._blur_px), **self._model.arrays()}
        )

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            It is missing, broken or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            blur_px = blur_from(arrays, shape)
            model = StereoModel(
                part_from(LightField, arrays),
                part_from(Redundancy, arrays),
                part_from(LightDrift, arrays),
            )
            if not np.isfinite(model.field(np.zeros((1, shape[2] + 2), np.float32))).all():
                raise ValueError("the model gives no numbers")
        return cls(model, shape, blur_px)


class PhotometricCalibrator(Calibrator):
    """Learns the lights from presses, or takes them from where the profile has them."""

    compensation: ClassVar[Compensation] = "none"
    Options: ClassVar[type[BaseModel]] = StereoOptions
    options: StereoOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> PhotometricStereo:
        """Fit on pixels of known slope, of a ball, a grid of balls or a height map.

        Raises
        ------
        CalibrationError
            There are fewer than three lights, or too few pixels.
        """
        shape = shape_of(reference)
        if shape[2] < FEWEST_LIGHTS:
            raise CalibrationError(
                f"photometric stereo needs {FEWEST_LIGHTS} lamps and there are {shape[2]}; choose "
                f"another calibration"
            )
        blur_px = self.smoothing_px(scale_of(presses))
        features, normal_xy = samples_of(presses, reference, blur_px=blur_px)
        field = fit_light_field(features, normal_xy)
        response = field.response(features[:, :-2]).T
        redundancy = fit_redundancy(response)
        drift = fit_light_drift(response, field(features).T, field.exponents, redundancy)
        model = StereoModel(field, redundancy, drift)
        prepared = PhotometricStereo(model, shape, blur_px).field(reference)
        zero = _seeming_change(prepared, presses, field.exponents)
        return PhotometricStereo(replace(model, drift=replace(drift, zero=zero)), shape, blur_px)

    def from_lights(self, lights: Sequence[Light]) -> Calibration | None:
        """Lights where the profile has them, if ``lights: given``."""
        if self.options.lights != "given":
            return None
        azimuths = [light.azimuth_deg for light in lights]
        return GivenLights(light_directions(azimuths, [light.elevation_deg for light in lights]))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing that the options ask for."""
        return self.options.smoothing_px(mm_per_px)


def _seeming_change(field: StereoField, presses: Sequence[Press], exponents: Float32) -> Float32:
    """(K,) mean change of the responses that some frames of the calibration seem to show."""
    pressed = {id(press.frame): press.frame for press in presses if press.gradients.any()}
    frames = list(pressed.values())
    some = frames[:: max(1, len(frames) // _FRAMES)]
    gains = np.stack([field.gains(frame.pixels, frame.marker_mask) for frame in some])
    return np.asarray((gains**exponents - 1).mean(axis=0), np.float32)
