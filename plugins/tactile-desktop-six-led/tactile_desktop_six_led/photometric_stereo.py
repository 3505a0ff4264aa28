"""``desktop_six_led.photometric_stereo``: slopes from lights that are lit one after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.shrinking import interpolate_cells
from tactile_core.algorithms.slopes.slope_grid import PressLight
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration, Calibrator, Press
from tactile_core.interfaces.for_reference import ForReference
from tactile_core.interfaces.illumination import Light
from tactile_core.interfaces.slope_models.model_file import (
    arrays_of,
    blur_from,
    part_from,
    stored_model,
    write_model,
)
from tactile_core.interfaces.slope_models.samples import (
    ImageShape,
    SlopeOptions,
    check_fitting,
    is_grid,
    press_light_of,
    samples_of,
    scale_of,
    shape_of,
    without_grain,
)
from tactile_core.interfaces.slope_models.slope_model import slopes_of
from tactile_core.quantities import Bool, Frame, Gradients, Reference
from tactile_desktop_six_led.given_lights import GivenLights, light_directions
from tactile_desktop_six_led.light_field import LightField
from tactile_desktop_six_led.light_fit import fit_light_field
from tactile_desktop_six_led.lit_lights import LitLights, fit_lit_lights
from tactile_desktop_six_led.redundancy import Redundancy, fit_redundancy
from tactile_desktop_six_led.stereo_field import StereoField

FEWEST_LIGHTS = 3  # A normal times an albedo has three unknowns


@dataclass(frozen=True, eq=False)
class StereoModel:
    """A light field with its change by a press, and what the lights have in common.

    Attributes
    ----------
    field, press_light
        Normals from all lights, and their change by a press.
    lit_lights
        Normals beyond the calibrated slopes.
    redundancy
        What shows a light in shadow or with a highlight.
    """

    field: LightField
    redundancy: Redundancy
    press_light: PressLight
    lit_lights: LitLights

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the fitted arrays by name."""
        parts = self.field, self.redundancy, self.press_light, self.lit_lights
        return {name: array for part in parts for name, array in arrays_of(part).items()}


class StereoOptions(SlopeOptions):
    """Options of ``desktop_six_led.photometric_stereo``."""

    light_blur_mm: float = Field(
        default=0.11,
        ge=0,
        le=10,
        description="Additional smoothing of the reference, whose grain differs from that under a "
        "press: standard deviation, mm.",
    )
    lights: Literal["learned", "given"] = Field(
        default="learned",
        description="learned: fit the lights to presses. given: measure without a bundle, with the "
        "light directions of the profile.",
    )


class PhotometricStereo(Calibration):
    """Photometric stereo with a light field, a response per light, and outlier rejection.

    Works with three lights or more. With five lights or more, the response of a light in shadow or
    with a highlight is replaced by the prediction of the others.
    The model is physical, so that it extrapolates to slopes steeper than those of the calibration,
    where a regression levels off.
    """

    def __init__(
        self, model: StereoModel, shape: ImageShape, blur_px: float, light_blur_px: float
    ) -> None:
        self._model, self._shape = model, shape
        self._blur_px, self._light_blur_px = blur_px, light_blur_px
        self._field = ForReference(self.field)

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of one frame.

        Slopes are valid where they are measurable and the lights are consistent.

        Raises
        ------
        CalibrationError
            Size or number of channels of the frame or the reference differ from the training
            images, or the full scales of frame and reference differ.
        """
        check_fitting(frame, reference, self._shape)
        cells, inconsistent = self._field(reference).measure(frame.pixels, frame.marker_mask)
        shape = frame.pixels.shape[0], frame.pixels.shape[1]

        def consistent() -> Bool:
            return np.equal(interpolate_cells(inconsistent, cells.step_px, shape), 0)

        return slopes_of(frame, cells, consistent if inconsistent.any() else None)

    def field(self, reference: Reference) -> StereoField:
        """Prepare the model for one reference."""
        return StereoField(
            self._model.field,
            self._model.redundancy,
            self._model.press_light,
            self._model.lit_lights,
            without_grain(reference, self._light_blur_px),
            self._blur_px,
        )

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        blurs_px = {
            "blur_px": np.array(self._blur_px),
            "light_blur_px": np.array(self._light_blur_px),
        }
        write_model(directory, self._shape, {**blurs_px, **self._model.arrays()})

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``.

        Raises
        ------
        CalibrationError
            The file is missing, damaged or of another model.
        """
        with stored_model(directory) as (shape, arrays):
            blur_px = blur_from(arrays, shape)
            light_blur_px = blur_from(arrays, shape, "light_blur_px")
            model = StereoModel(
                part_from(LightField, arrays),
                part_from(Redundancy, arrays),
                part_from(PressLight, arrays),
                part_from(LitLights, arrays),
            )
            if not np.isfinite(model.field(np.zeros((1, shape[2] + 2), np.float32))).all():
                raise ValueError("the model does not return finite numbers")
        return cls(model, shape, blur_px, light_blur_px)


class PhotometricCalibrator(Calibrator):
    """Fits the lights to presses, or takes their directions from the profile.

    References
    ----------
    .. [1] M. K. Johnson, F. Cole, A. Raj and E. H. Adelson, "Microgeometry capture using an
       elastomeric sensor", ACM Transactions on Graphics 30(4), 2011.
    """

    Options: ClassVar[type[BaseModel]] = StereoOptions
    options: StereoOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> PhotometricStereo:
        """Fit to presses of a ball, a grid of balls, or a surface with a height map.

        Raises
        ------
        CalibrationError
            There are fewer than three lights, or too few pixels.
        """
        shape = shape_of(reference)
        if shape[2] < FEWEST_LIGHTS:
            raise CalibrationError(
                f"photometric stereo needs {FEWEST_LIGHTS} lights and there are {shape[2]}; choose "
                f"another calibration"
            )
        scale = scale_of(presses)
        blur_px, light_blur_px = self.smoothing_px(scale), self.options.light_blur_mm / scale
        light = without_grain(reference, light_blur_px)
        features, normal_xy = samples_of(presses, light, blur_px=blur_px)
        field, tilt = fit_light_field(features, normal_xy, tilted=is_grid(presses))
        response, position = field.response(features[:, :-2]).T, features[:, -2:]
        b = field.directions(response, position)
        press_light = press_light_of(tilt, presses)
        b[:2] += press_light.tilt_at(position) * normal_xy.any(axis=1)
        fitted = (b[:2] / np.linalg.norm(b, axis=0)).T
        lit_lights = fit_lit_lights(response, position, normal_xy, fitted)
        redundancy = fit_redundancy(response)
        model = StereoModel(field, redundancy, press_light, lit_lights)
        return PhotometricStereo(model, shape, blur_px, light_blur_px)

    def from_lights(self, lights: Sequence[Light]) -> Calibration | None:
        """Return a model with the profile's light directions, if ``lights: given``."""
        if self.options.lights != "given":
            return None
        azimuths = [light.azimuth_deg for light in lights]
        return GivenLights(light_directions(azimuths, [light.elevation_deg for light in lights]))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return the smoothing of the options in px."""
        return self.options.smoothing_px(mm_per_px)
