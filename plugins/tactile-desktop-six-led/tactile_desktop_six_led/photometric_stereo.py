"""``desktop_six_led.photometric_stereo``: slopes from lamps that shine one after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from numpy.typing import NDArray
from pydantic import BaseModel

from tactile_core.algorithms.colour_table import ColourTable
from tactile_core.builtin.slope_calibration import (
    Arrays,
    SlopeCalibration,
    SlopeOptions,
    blur_of,
    samples_of,
    shape_of,
)
from tactile_core.calibration import Press
from tactile_core.errors import CalibrationError
from tactile_core.quantities import Float32, Reference
from tactile_desktop_six_led.light_field import LightField, fit_light_field
from tactile_desktop_six_led.redundancy import Redundancy, fit_redundancy
from tactile_desktop_six_led.stereo_field import StereoField

FEWEST_LAMPS = 3


@dataclass(frozen=True, eq=False)
class Lamps:
    """A light field, and what its lamps say in common."""

    field: LightField
    redundancy: Redundancy

    def __call__(self, features: Float32) -> Float32:
        """Map (N, K + 2) features to (N, 2) sines."""
        return self.field(features)


class PhotometricStereo(SlopeCalibration):
    """Light that varies over the image, each lamp's own response, shadows and highlights rejected.

    Any three lamps or more; from five on, a lamp that a shadow or a highlight spoils is replaced by
    what the others say, from six on two of them. Steeper slopes than were pressed are read by the
    same law, so that it extrapolates where a regression levels off.
    """

    USE: ClassVar[str] = "desktop_six_led.photometric_stereo"
    Options: ClassVar[type[BaseModel]] = SlopeOptions
    _model: Lamps

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
        redundancy = fit_redundancy(field.response(features[:, :-2]).T)
        return cls(Lamps(field, redundancy), None, shape, blur_px)

    def _prepare(self, reference: Reference) -> StereoField:
        return StereoField(
            self._model.field,
            self._model.redundancy,
            reference.pixels,
            reference.marks,
            full_scale=reference.full_scale,
            blur_px=self._blur_px,
        )

    def _arrays(self) -> dict[str, NDArray[Any]]:
        return self._model.field.arrays() | self._model.redundancy.arrays()

    @classmethod
    def _model_from(cls, arrays: Arrays, table: ColourTable | None) -> Lamps:
        return Lamps(LightField.from_arrays(arrays), Redundancy.from_arrays(arrays))
