"""``core.lookup_table``: the papers' table from colour change to slope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.regression import PolynomialFit, fit_polynomial
from tactile_core.algorithms.colour_table import TABLE, Axis, ColourTable, as_complex
from tactile_core.algorithms.slope_field import takes_table
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibrator import Calibrator, Press
from tactile_core.interfaces.slope_models.image_shape import shape_of
from tactile_core.interfaces.slope_models.model_file import Arrays, table_arrays, table_from
from tactile_core.interfaces.slope_models.options import SlopeOptions
from tactile_core.interfaces.slope_models.samples import samples_of, scale_of
from tactile_core.interfaces.slope_models.slope_calibration import SlopeCalibration
from tactile_core.interfaces.slope_models.slope_model import SlopeModel
from tactile_core.interfaces.slope_models.tables import faithful
from tactile_core.quantities import Float32, Reference

CELL_BLUR_ENTRIES = 1.2
FILLED_WEIGHT = 1e-3


class LookupTableOptions(SlopeOptions):
    """Options of ``core.lookup_table``."""

    bins: int = Field(default=TABLE.bins, ge=8, le=128, description="Entries per channel.")


@dataclass(frozen=True, eq=False)
class TableModel:
    """A table over colour with a first-order term around each entry, which depends on the place.

    The papers' entries hold a gradient and a first-order approximation of the reflectance around
    it (review, section 3.3). What varies most around an entry is the light over the gel, so the
    term is taken in the place, with coefficients that are themselves smooth in the colour.
    """

    table: ColourTable
    around: PolynomialFit

    def __call__(self, features: Float32) -> Float32:
        """Map (N, 5) features to (N, 2) sines."""
        return self.table.nearest(features[:, :3]) + self.around(features)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Coefficients of the term, and the table."""
        return self.around.arrays() | table_arrays(self.table)

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> Self:
        """Rebuild both."""
        return cls(table_from(arrays), PolynomialFit.from_arrays(arrays))


class LookupTable(SlopeCalibration):
    """A fitted table."""

    function = TableModel


class LookupTableCalibrator(Calibrator):
    """80³ entries, averaged over the presses; empty entries by linear interpolation."""

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
        features, normal_xy = samples_of(presses, reference, blur_px=blur_px, most=60_000)
        table = _filled(features[:, :3], normal_xy, self.options.bins)
        missing = normal_xy - table.nearest(features[:, :3])
        around = fit_polynomial(features, missing, order=2, ridge=1e-3)
        function = TableModel(table, around)
        if takes_table(shape):
            table = faithful(table, function, presses, reference, blur_px) or table
        return LookupTable(SlopeModel(function, shape, blur_px, table))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing that the options ask for."""
        return self.options.smoothing_px(mm_per_px)


def _filled(changes: Float32, normal_xy: Float32, bins: int) -> ColourTable:
    """Average the samples of each entry and its near neighbours, then fill the rest."""
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
    # Entries that few pixels hit are noisy; their neighbours saw nearly the same colour.
    weight = gaussian_filter(count, CELL_BLUR_ENTRIES, mode="constant", truncate=2.5)
    mean = (
        np.stack(
            [gaussian_filter(t, CELL_BLUR_ENTRIES, mode="constant", truncate=2.5) for t in total],
            -1,
        )
        / np.maximum(weight, 1e-9)[..., None]
    )
    full = weight > FILLED_WEIGHT
    holes = np.argwhere(~full)
    thin = seen[:: max(1, len(seen) // 3000)]
    mean[~full] = NearestNDInterpolator(thin, mean[tuple(thin.T)])(holes)
    inside = LinearNDInterpolator(thin, mean[tuple(thin.T)])(holes)
    known = np.isfinite(inside[:, 0])
    mean[tuple(holes[known].T)] = inside[known]
    return ColourTable(axis, as_complex(mean.astype(np.float32)))
