"""``core.poisson``: height from slopes, relative to the undeformed surface."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import cv2
import numpy as np
from pydantic import BaseModel, Field, NonNegativeFloat

from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.algorithms.levelling import set_to_rest
from tactile_core.algorithms.poisson import PoissonSolver
from tactile_core.algorithms.poisson.propagation import height_std
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import Float32, Gradients, HeightMap, ReferenceGradients

DriftSlope = Annotated[
    NonNegativeFloat,
    Field(
        description="Largest tilt of the whole map that is removed as drift, dimensionless; "
        "0: only the level is removed."
    ),
]
"""Option of the steps that integrate slopes."""

DRIFT_SLOPE = 0.05
"""Default of this option."""

Levelled = Annotated[
    bool,
    Field(
        description="Subtract the smooth error of the height that the undeformed part of the gel "
        "surface reveals."
    ),
]
"""Option of the steps that integrate slopes."""


class Poisson(Estimator):
    """Integrates the slopes exactly and sets the undeformed surface to 0.

    Slopes that the calibration measures on the reference itself are errors and are subtracted, so
    the height of the reference is 0. With "neumann" the height has a free constant, set by the
    surface out of contact. A tilt of the whole map below ``drift_slope`` counts as illumination
    drift and is removed, too, since no press tilts the surface far from it; for the exceptions see
    :func:`tactile_core.algorithms.rest_surface.rest_plane`. With ``levelled``, other smooth errors
    are estimated where the surface is undeformed, and subtracted; see
    :func:`tactile_core.algorithms.rest_area.height_error`. With "dirichlet" the height is 0 at the
    border of the image, and nothing is shifted.

    References
    ----------
    .. [1] T. Simchony, R. Chellappa and M. Shao, "Direct analytical methods for solving Poisson
       equations in computer vision problems", IEEE Transactions on Pattern Analysis and Machine
       Intelligence 12(5), 1990.
    """

    class Options(device.Options):
        """Options of the step."""

        boundary: Literal["neumann", "dirichlet"] = Field(
            default="neumann",
            description="neumann: the border of the image is free; dirichlet: its height is 0.",
        )
        drift_slope: DriftSlope = DRIFT_SLOPE
        levelled: Levelled = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        self._boundary = options.boundary
        self._drift_slope = options.drift_slope
        self._levelled = options.levelled

    def estimate(
        self, gradients: Gradients, reference: ReferenceGradients | None = None
    ) -> HeightMap:
        """Return the height, 0 where undeformed and positive where pressed."""
        gradients = relative_to(gradients, reference)
        gx, gy, mm_per_px = gradients.x, gradients.y, gradients.mm_per_px
        solver = PoissonSolver(
            gx.shape,
            mm_per_px=mm_per_px,
            boundary=self._boundary,
            compiled=self.context.compiled,
        )
        height_mm = solver.solve(gx, gy)
        if self._boundary == "neumann":
            set_to_rest(
                height_mm,
                gx,
                gy,
                mm_per_px=mm_per_px,
                drift_slope=self._drift_slope,
                levelled=self._levelled,
                thickness_mm=self.context.gel.thickness_mm or THICKNESS_MM,
                compiled=self.context.compiled,
            )
        return height_map(height_mm, gradients, self.context)


def relative_to(gradients: Gradients, reference: ReferenceGradients | None) -> Gradients:
    """Subtract the slopes that the calibration measures on the reference, if there are any."""
    if reference is None:
        return gradients
    return replace(gradients, x=gradients.x - reference.x, y=gradients.y - reference.y)


def height_map(height_mm: Float32, gradients: Gradients, context: SensorContext) -> HeightMap:
    """Make a height map of the (H, W) height that was integrated from these slopes."""
    return HeightMap(
        height_mm,
        gradients.valid,
        gradients.mm_per_px,
        gradients.timestamp_s,
        context.rest_mm,
        _std_cells_mm(height_mm, gradients),
    )


def _std_cells_mm(height_mm: Float32, gradients: Gradients) -> Float32 | None:
    """Propagate the errors of slopes: those of each pixel, and a factor that they share."""
    cells, gain, correlation_mm = (
        gradients.std_cells,
        gradients.gain_std,
        gradients.correlation_mm,
    )
    if cells is None or gain is None or correlation_mm is None:
        return None
    scale, (rows, columns) = gradients.mm_per_px, cells.shape
    cell_mm = (scale * height_mm.shape[0] / rows, scale * height_mm.shape[1] / columns)
    common = cv2.resize(height_mm, (columns, rows), interpolation=cv2.INTER_NEAREST) * gain
    return np.asarray(np.hypot(height_std(cells, cell_mm, correlation_mm), common), np.float32)
