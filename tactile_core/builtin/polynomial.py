"""``core.polynomial``: slopes as a polynomial of the colours and the place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Self

from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Calibrator, Press
from tactile_core.interfaces.slope_models.image_shape import shape_of
from tactile_core.interfaces.slope_models.options import SlopeOptions
from tactile_core.interfaces.slope_models.samples import samples_of, scale_of
from tactile_core.interfaces.slope_models.slope_model import SlopeModel
from tactile_core.interfaces.slope_models.tables import baked
from tactile_core.quantities import Frame, Gradients, Reference


class PolynomialOptions(SlopeOptions):
    """Options of ``core.polynomial``."""

    order: int = Field(default=2, ge=1, le=4, description="Highest total degree.")
    ridge: float = Field(default=0.03, gt=0, description="Penalty on the coefficients.")


class Polynomial(Calibration):
    """A fitted polynomial."""

    def __init__(self, slopes: SlopeModel[PolynomialFit]) -> None:
        self.slopes = slopes

    def prepared(self, *, compiled: bool) -> Self:
        """Return the model with or without compiled loops."""
        return type(self)(replace(self.slopes, compiled=compiled))

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Slopes of one frame; see :meth:`SlopeModel.measure`."""
        return self.slopes.measure(frame, reference)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        self.slopes.save(directory)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``; see :meth:`SlopeModel.load`."""
        return cls(SlopeModel.load(directory, PolynomialFit))


class PolynomialCalibrator(Calibrator):
    """Ridge regression; the best choice with few presses, for it cannot overfit."""

    Options: ClassVar[type[BaseModel]] = PolynomialOptions
    options: PolynomialOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> Polynomial:
        """Fit on presses of a known ball."""
        blur_px = self.smoothing_px(scale_of(presses))
        features, sines = samples_of(presses, reference, blur_px=blur_px)
        order, ridge = self.options.order, self.options.ridge
        function = fit_polynomial(features, sines, order=order, ridge=ridge)
        table = baked(function, features, presses, reference, blur_px)
        return Polynomial(SlopeModel(function, shape_of(reference), blur_px, table))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing that the options ask for."""
        return self.options.smoothing_px(mm_per_px)
