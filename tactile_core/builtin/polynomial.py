"""``core.polynomial``: slopes as a polynomial of the colours and the place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial
from tactile_core.algorithms.colour_table import ColourTable
from tactile_core.builtin.image_shape import shape_of
from tactile_core.builtin.model_file import Arrays
from tactile_core.builtin.slope_calibration import SlopeCalibration, SlopeOptions
from tactile_core.builtin.slope_training import baked, blur_of, samples_of
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Reference


class PolynomialOptions(SlopeOptions):
    """Options of ``core.polynomial``."""

    order: int = Field(default=2, ge=1, le=4, description="Highest total degree.")
    ridge: float = Field(default=0.03, gt=0, description="Penalty on the coefficients.")


class Polynomial(SlopeCalibration):
    """Ridge regression; the best choice with few presses, for it cannot overfit."""

    USE: ClassVar[str] = "core.polynomial"
    Options: ClassVar[type[BaseModel]] = PolynomialOptions
    _model: PolynomialFit

    @classmethod
    def fit(cls, samples: Sequence[Press], reference: Reference, options: BaseModel) -> Polynomial:
        """Fit on presses of a known ball."""
        assert isinstance(options, PolynomialOptions)
        blur_px = blur_of(options, samples)
        features, sines = samples_of(samples, reference, blur_px=blur_px)
        model = fit_polynomial(features, sines, order=options.order, ridge=options.ridge)
        table = baked(model, features, samples, reference, blur_px)
        return cls(model, table, shape_of(reference), blur_px)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        return self._model.arrays()

    @classmethod
    def _model_from(cls, arrays: Arrays, table: ColourTable | None) -> PolynomialFit:
        return PolynomialFit.from_arrays(arrays)
