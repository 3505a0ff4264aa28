"""``desktop_six_led.photometric_stereo``: slopes from lamps that shine one after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.algorithms.colour_table import ColourTable
from tactile_core.builtin.image_shape import shape_of
from tactile_core.builtin.model_file import Arrays, arrays_of, part_from
from tactile_core.builtin.slope_calibration import SlopeCalibration, SlopeOptions
from tactile_core.builtin.slope_training import blur_of, samples_of
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration, Compensation, Press
from tactile_core.quantities import Float32, Reference
from tactile_desktop_six_led.given_lights import GivenLights, lamp_directions
from tactile_desktop_six_led.lamp_drift import LampDrift, fit_lamp_drift
from tactile_desktop_six_led.light_field import LightField
from tactile_desktop_six_led.light_fit import fit_light_field
from tactile_desktop_six_led.redundancy import Redundancy, fit_redundancy
from tactile_desktop_six_led.stereo_field import StereoField

FEWEST_LAMPS = 3
_FRAMES = 5


@dataclass(frozen=True, eq=False)
class StereoModel:
    """A light field, what its lamps say in common, and how their drift is told."""

    field: LightField
    redundancy: Redundancy
    drift: LampDrift

    def __call__(self, features: Float32) -> Float32:
        """Map (N, K + 2) features to (N, 2) sines."""
        return self.field(features)


class StereoOptions(SlopeOptions):
    """Options of ``desktop_six_led.photometric_stereo``."""

    lights: Literal["learned", "given"] = Field(
        default="learned",
        description="given: measure with no bundle, with the lights where the profile has them.",
    )


class PhotometricStereo(SlopeCalibration):
    """Light that varies over the image, each lamp's own response, shadows and highlights rejected.

    Any three lamps or more; from five on, a lamp that a shadow or a highlight spoils is replaced by
    what the others say, from six on two of them; a lamp that has drifted is told by the others,
    too. Steeper slopes than were pressed are read by the same law, so that it extrapolates where a
    regression levels off.
    """

    USE: ClassVar[str] = "desktop_six_led.photometric_stereo"
    compensation: ClassVar[Compensation] = "none"
    Options: ClassVar[type[BaseModel]] = StereoOptions
    _model: StereoModel

    @classmethod
    def fit(cls, samples: Sequence[Press], reference: Reference, options: BaseModel) -> Self:
        """Fit on pixels of known slope, of a ball, a grid of balls or a height map.

        Raises
        ------
        CalibrationError
            There are fewer than three lamps, or too few pixels.
        """
        assert isinstance(options, SlopeOptions)
        shape = shape_of(reference)
        if shape[2] < FEWEST_LAMPS:
            raise CalibrationError(
                f"photometric stereo needs {FEWEST_LAMPS} lamps and there are {shape[2]}; choose "
                f"another calibration"
            )
        blur_px = blur_of(options, samples)
        features, sines = samples_of(samples, reference, blur_px=blur_px)
        field = fit_light_field(features, sines)
        response = field.response(features[:, :-2]).T
        redundancy = fit_redundancy(response)
        drift = fit_lamp_drift(response, field(features).T, field.exponents, redundancy)
        fitted = cls(StereoModel(field, redundancy, drift), None, shape, blur_px)
        zero = fitted._seeming_change(samples, reference)
        return cls(StereoModel(field, redundancy, replace(drift, zero=zero)), None, shape, blur_px)

    @classmethod
    def from_lights(
        cls, options: BaseModel, azimuth_deg: Sequence[float], elevation_deg: Sequence[float]
    ) -> Calibration | None:
        """Lamps where the profile has them, if ``lights: given``."""
        if not isinstance(options, StereoOptions) or options.lights != "given":
            return None
        return GivenLights(lamp_directions(azimuth_deg, elevation_deg))

    def _seeming_change(self, samples: Sequence[Press], reference: Reference) -> Float32:
        """(K,) mean change of the responses that some frames of the calibration seem to show."""
        prepared = self._prepare(reference)
        pressed = {id(p.frame): p.frame for p in samples if p.gradients.any()}
        frames = list(pressed.values())
        some = frames[:: max(1, len(frames) // _FRAMES)]
        gains = np.stack([prepared.gains(frame.pixels, frame.marks) for frame in some])
        return np.asarray((gains**self._model.field.exponents - 1).mean(axis=0), np.float32)

    def _prepare(self, reference: Reference) -> StereoField:
        return StereoField(
            self._model.field,
            self._model.redundancy,
            self._model.drift,
            reference.pixels,
            reference.marks,
            full_scale=reference.full_scale,
            blur_px=self._blur_px,
        )

    def _arrays(self) -> dict[str, NDArray[Any]]:
        model = self._model
        return arrays_of(model.field) | arrays_of(model.redundancy) | arrays_of(model.drift)

    @classmethod
    def _model_from(cls, arrays: Arrays, table: ColourTable | None) -> StereoModel:
        return StereoModel(
            part_from(LightField, arrays),
            part_from(Redundancy, arrays),
            part_from(LampDrift, arrays),
        )
