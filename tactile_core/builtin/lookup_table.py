"""``core.lookup_table`` and ``core.polynomial``: models of colour and slope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial
from tactile_core.algorithms.arrays.types import as_complex
from tactile_core.algorithms.slopes.colour_table import (
    TABLE,
    Axis,
    ColourTable,
    coarse_count,
    refine_table,
)
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibrator, Press
from tactile_core.interfaces.slope_models.model_file import Arrays, table_arrays, table_from
from tactile_core.interfaces.slope_models.samples import (
    SlopeOptions,
    baked,
    samples_of,
    scale_of,
    shape_of,
)
from tactile_core.interfaces.slope_models.slope_model import SlopeCalibration, SlopeModel
from tactile_core.quantities import Float32, Reference


class LookupTableOptions(SlopeOptions):
    """Options of ``core.lookup_table``."""

    bins: int = Field(
        default=TABLE.bins, ge=8, le=128, description="Entries of the table per channel."
    )


@dataclass(frozen=True, eq=False)
class TableModel:
    """Lookup table over colour with a smooth term in colour and position.

    Each entry of the published table [1]_ holds a gradient and a first-order approximation of the
    reflectance around it. Around an entry, the light over the gel varies most. So the term here
    depends on the position, with coefficients that are smooth in the colour.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: high-resolution robot tactile sensors for
       estimating geometry and force", Sensors 17(12), 2017, section 3.3.
    """

    table: ColourTable
    around: PolynomialFit

    def __call__(self, features: Float32) -> Float32:
        """Map (N, 5) features to the (N, 2) components of unit normals."""
        return self.table.nearest(features[:, :3]) + self.around(features)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the coefficients of the term, and the table."""
        return self.around.arrays() | table_arrays(self.table)

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> Self:
        """Rebuild the model from :meth:`arrays`."""
        return cls(table_from(arrays), PolynomialFit.from_arrays(arrays))


class LookupTable(SlopeCalibration):
    """Calibration with a fitted lookup table."""

    function = TableModel


class LookupTableCalibrator(Calibrator):
    """Fits a table of 80³ entries, averaged over presses; empty entries are interpolated.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: high-resolution robot tactile sensors for
       estimating geometry and force", Sensors 17(12), 2017, section 3.5.
    """

    Options: ClassVar[type[BaseModel]] = LookupTableOptions
    options: LookupTableOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> LookupTable:
        """Fit on presses of a known ball.

        Raises
        ------
        CalibrationError
            The frames do not have three channels.
        """
        shape = shape_of(reference)
        if shape[2] != 3:
            raise CalibrationError(
                f"core.lookup_table is a table over three channels and the frames have {shape[2]}; "
                f"use core.mlp or core.polynomial"
            )
        blur_px = self.smoothing_px(scale_of(presses))
        # [pixels]
        features, normal_xy = samples_of(presses, reference, blur_px=blur_px, most=60_000)
        table = _fill_table(features[:, :3], normal_xy, self.options.bins)
        missing = normal_xy - table.nearest(features[:, :3])
        around = fit_polynomial(features, missing, order=2, ridge=1e-3)
        function = TableModel(table, around)
        return LookupTable(SlopeModel(function, shape, blur_px, table))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing set by the options."""
        return self.options.smoothing_px(mm_per_px)


def _fill_table(changes: Float32, normal_xy: Float32, bins: int) -> ColourTable:
    """Average the samples of each entry and its neighbours, and interpolate the empty entries."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
    from scipy.ndimage import gaussian_filter

    axis = Axis.spanning(changes, bins)
    empty = ColourTable(axis, np.zeros((bins,) * 3, np.complex64))
    index = tuple(empty.bins(changes).astype(np.intp).T)
    count = np.zeros((bins,) * 3, np.float32)
    total = np.zeros((2, bins, bins, bins), np.float32)
    np.add.at(count, index, 1)
    for k in range(2):
        np.add.at(total[k], index, normal_xy[:, k])
    seen = np.argwhere(count > 0)
    # Entries with few samples are noisy; samples of their neighbours have nearly the same colour.
    blur, window = 1.2, 2.5  # [entries] standard deviation, and half the window in those
    weight, *sums = (
        gaussian_filter(values, blur, mode="constant", truncate=window)
        for values in (count, *total)
    )
    mean = np.stack(sums, -1) / np.maximum(weight, 1e-9)[..., None]  # no division by zero
    full = weight > 1e-3  # [samples] emptier entries are interpolated
    nodes = seen[:: max(1, len(seen) // 3000)]  # [entries] for speed
    # Interpolated values vary over the distance of the nodes, so every fourth entry is enough.
    steps = 2**TABLE.halvings * np.arange(coarse_count(bins, TABLE.halvings))
    places = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1)
    found = LinearNDInterpolator(nodes, mean[tuple(nodes.T)])(places)
    outside = ~np.isfinite(found[..., 0])
    found[outside] = NearestNDInterpolator(nodes, mean[tuple(nodes.T)])(places[outside])
    entries = refine_table(as_complex(found.astype(np.float32)), bins, TABLE.halvings)
    return ColourTable(axis, np.where(full, as_complex(mean.astype(np.float32)), entries))


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
