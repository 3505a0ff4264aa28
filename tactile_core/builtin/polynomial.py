"""``core.polynomial``: slopes as a polynomial of colour and position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial
from tactile_core.interfaces.calibrator import Calibrator, Press
from tactile_core.interfaces.slope_models.image_shape import shape_of
from tactile_core.interfaces.slope_models.options import SlopeOptions
from tactile_core.interfaces.slope_models.samples import samples_of, scale_of
from tactile_core.interfaces.slope_models.slope_calibration import SlopeCalibration
from tactile_core.interfaces.slope_models.slope_model import SlopeModel
from tactile_core.interfaces.slope_models.tables import baked
from tactile_core.quantities import Float32, Reference


def fit_curve(
    features: Float32,
    normal_xy: Float32,
    *,
    order: int = 3,
    ridge: float = 0.01,
    variation: float = 0.0,
) -> PolynomialFit:
    """Fit normal_xy (N, 2) as a polynomial of features (N, K + 2), with its curvature penalised."""
    return fit_polynomial(
        features, normal_xy, order=order, ridge=ridge, curvature_only=True, variation=variation
    )


class PolynomialOptions(SlopeOptions):
    """Options of ``core.polynomial``."""

    order: int = Field(default=3, ge=1, le=4, description="Highest total degree.")
    ridge: float = Field(default=0.01, gt=0, description="Penalty of curvature per sample.")
    variation: float = Field(
        default=0.3,
        ge=0,
        description="Penalty of the variation of the light with the position, per sample, divided "
        "by the number of presses.",
    )


class Polynomial(SlopeCalibration):
    """Calibration with a fitted polynomial."""

    function = PolynomialFit


class PolynomialCalibrator(Calibrator):
    """Fits a polynomial whose curvature is penalised; the best choice with few presses.

    Only what bends is shrunk: a penalty of the linear terms would flatten all slopes. So is what
    varies with the position. The samples of a press share its light and the error of its circle,
    so that this penalty decreases with the number of presses.
    """

    Options: ClassVar[type[BaseModel]] = PolynomialOptions
    options: PolynomialOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> Polynomial:
        """Fit on presses of a known ball."""
        blur_px = self.smoothing_px(scale_of(presses))
        features, normal_xy = samples_of(presses, reference, blur_px=blur_px)
        options = self.options
        # within a single press the position and the slope are the same
        variation = options.variation / len(presses) if len(presses) > 1 else 0.0
        function = fit_curve(
            features,
            normal_xy,
            order=options.order,
            ridge=options.ridge,
            variation=variation,
        )
        table = baked(function, features, presses, reference, blur_px)
        return Polynomial(SlopeModel(function, shape_of(reference), blur_px, table))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing set by the options."""
        return self.options.smoothing_px(mm_per_px)
