"""``core.poisson`` and ``core.robust_poisson``: heights from slopes."""

from __future__ import annotations

from typing import Annotated, Literal

import cv2
import numpy as np
from pydantic import BaseModel, Field, NonNegativeFloat, PositiveInt

from tactile_core.algorithms.arrays.shrinking import interpolate_cells, refine_cells
from tactile_core.algorithms.force.elastic_layer import THICKNESS_MM
from tactile_core.algorithms.heights.levelling import SHADOW_SHARE, set_to_rest
from tactile_core.algorithms.poisson import integrate, integrate_robustly
from tactile_core.algorithms.poisson.integration import between_cells, height_std
from tactile_core.algorithms.slopes.slope_grid import SlopeCells
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.interfaces.for_reference import ForReference
from tactile_core.quantities import Float32, Gradients, HeightMap, ReferenceGradients
from tactile_core.quantities.quantity import Grid, grid_of, on_demand, on_grid

# Option of the steps that integrate slopes.
DriftSlope = Annotated[
    NonNegativeFloat,
    Field(
        description="Largest tilt of the whole map that is removed as drift, dimensionless; "
        "0: only the level is removed."
    ),
]

DRIFT_SLOPE = 0.05  # Default of this option

# Option of the steps that integrate slopes.
Levelled = Annotated[
    bool,
    Field(
        description="Subtract the smooth error of the height that the undeformed part of the gel "
        "surface reveals."
    ),
]

ShadowShare = Annotated[
    float,
    Field(
        ge=0,
        le=1,
        description="Largest share by which an object's shadow changes the slopes beside it; 0 "
        "where lights from several directions leave no shadow.",
    ),
]


class Poisson(Estimator):
    """Integrates the slopes exactly and sets the undeformed surface to 0.

    Slopes that the calibration measures on the reference itself are errors and are subtracted, so
    the height of the reference is 0. With "neumann" the height has a free constant, set by the
    surface out of contact. A tilt of the whole map below ``drift_slope`` counts as illumination
    drift and is removed, too, since no press tilts the surface far from it; for the exceptions see
    :func:`tactile_core.algorithms.heights.levelling.fit_rest_plane`. With ``levelled``, other
    smooth errors are estimated where the surface is undeformed, and subtracted; see
    :func:`tactile_core.algorithms.heights.levelling.estimate_error`. With "dirichlet" the height is
    0 at the border of the image, and nothing is shifted.

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
        shadow_share: ShadowShare = SHADOW_SHARE

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        self._boundary = options.boundary
        self._drift_slope = options.drift_slope
        self._levelled = options.levelled
        self._shadow_share = options.shadow_share
        self._levels = ForReference(_levels)

    def estimate(
        self, gradients: Gradients, reference: ReferenceGradients | None = None
    ) -> HeightMap:
        """Return the height, 0 where undeformed and positive where pressed."""
        slopes = self._relative_to(gradients, reference)
        mm_per_cell = gradients.mm_per_px * slopes.step_px
        gx, gy, step_px = slopes.gx, slopes.gy, slopes.step_px
        # cells are wide enough for the curvature of the surface to matter between their centres
        sharp = between_cells(gx, gy, averaged=slopes.averaged) if step_px > 1 else (gx, gy)
        height_mm = integrate(*sharp, mm_per_px=mm_per_cell, boundary=self._boundary)
        if self._boundary == "neumann":
            set_to_rest(
                height_mm,
                gx,
                gy,
                mm_per_px=mm_per_cell,
                drift_slope=self._drift_slope,
                levelled=self._levelled,
                shadow_share=self._shadow_share,
                thickness_mm=self.context.gel.thickness_mm or THICKNESS_MM,
            )
        return height_map(height_mm, gradients, self.context, step_px, averaged=slopes.averaged)

    def _relative_to(
        self, gradients: Gradients, reference: ReferenceGradients | None
    ) -> SlopeCells:
        """Return the slopes above those of the reference, on the grid to integrate them on."""
        slopes = _cells(gradients).for_heights()
        if reference is None:
            return slopes
        levels = self._levels(reference)
        if levels.step_px != slopes.step_px:
            return SlopeCells(*relative_to(gradients, reference), step_px=1)
        gx, gy = slopes.gx - levels.gx, slopes.gy - levels.gy
        return SlopeCells(gx, gy, slopes.step_px, slopes.as_normals, slopes.averaged)


def relative_to(
    gradients: Gradients, reference: ReferenceGradients | None
) -> tuple[Float32, Float32]:
    """Subtract the slopes that the calibration measures on the reference, if there are any.

    Returns the (H, W) slopes of every pixel.
    """
    if reference is None:
        return gradients.x, gradients.y
    return gradients.x - reference.x, gradients.y - reference.y


def _cells(slopes: Gradients | ReferenceGradients) -> SlopeCells:
    x, y = grid_of(slopes, "x"), grid_of(slopes, "y")
    return SlopeCells(x.cells, y.cells, x.step_px, averaged=x.averaged)


def _levels(reference: ReferenceGradients) -> SlopeCells:
    return _cells(reference).for_heights()


def height_map(
    height_mm: Float32,
    gradients: Gradients,
    context: SensorContext,
    step_px: int = 1,
    *,
    averaged: bool = False,
) -> HeightMap:
    """Make a height map of the height that was integrated from these slopes.

    Parameters
    ----------
    height_mm : (h, w) float32
        At the centres of cells.
    gradients : Gradients
    context : SensorContext
    step_px : int
        Side of a cell.
    averaged : bool
        Whether these slopes were means over smaller cells.
    """
    shape = grid_of(gradients, "x").shape
    return HeightMap(
        _on_demand(Grid(height_mm, step_px, shape), averaged=averaged),
        on_demand(lambda: gradients.valid),
        gradients.mm_per_px,
        gradients.timestamp_s,
        context.rest_mm,
        on_demand(lambda: _std_cells_mm(height_mm, gradients)),
    )


def _on_demand(grid: Grid, *, averaged: bool) -> Float32:
    """Return a height on a grid; on the grid of averaged slopes its peaks lie between the cells."""
    if averaged:
        cells, step_px, shape, _ = grid
        return on_demand(lambda: interpolate_cells(refine_cells(cells), step_px // 2, shape), grid)
    return on_grid(grid.cells, grid.step_px, grid.shape)


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
    image = grid_of(gradients, "x").shape
    cell_mm = (scale * image[0] / rows, scale * image[1] / columns)
    common = cv2.resize(height_mm, (columns, rows), interpolation=cv2.INTER_NEAREST) * gain
    return np.asarray(np.hypot(height_std(cells, cell_mm, correlation_mm), common), np.float32)


class RobustPoisson(Estimator):
    """Integrates the slopes robustly against outliers, such as shadows and markers.

    Use it in place of ``core.poisson`` where slopes are inconsistent: an attached shadow on one
    flank, highlights, dust, markers. It takes 6 times as long at 320 × 240 and more at larger
    sizes. The border is free, and the undeformed surface is set to 0 as in
    :class:`~tactile_core.builtin.poisson.Poisson`. For the method see
    :func:`tactile_core.algorithms.poisson.integrate_robustly`.

    References
    ----------
    .. [1] P. J. Huber, "Robust estimation of a location parameter", Annals of Mathematical
       Statistics 35(1), 1964.
    """

    class Options(device.Options):
        """Options of the step."""

        outlier_slope: NonNegativeFloat = Field(
            default=0.02,
            description="Residual from which a slope is an outlier, dimensionless: about the error "
            "of a good slope (0.02 for 1°, 0.1 for a coarse fingertip); 0: L1 norm.",
        )
        rounds: PositiveInt = Field(
            default=8,
            le=1000,
            description="Number of iterations; each takes about as long as core.poisson.",
        )
        drift_slope: DriftSlope = DRIFT_SLOPE
        levelled: Levelled = True
        shadow_share: ShadowShare = SHADOW_SHARE

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        self._outlier_slope = options.outlier_slope
        self._rounds = options.rounds
        self._drift_slope = options.drift_slope
        self._levelled = options.levelled
        self._shadow_share = options.shadow_share

    def estimate(
        self, gradients: Gradients, reference: ReferenceGradients | None = None
    ) -> HeightMap:
        """Return the height, 0 where undeformed and positive where pressed."""
        gx, gy = relative_to(gradients, reference)
        height_mm = integrate_robustly(
            gx,
            gy,
            mm_per_px=gradients.mm_per_px,
            valid=gradients.valid,
            outlier_slope=self._outlier_slope,
            rounds=self._rounds,
        )
        set_to_rest(
            height_mm,
            gx,
            gy,
            mm_per_px=gradients.mm_per_px,
            drift_slope=self._drift_slope,
            levelled=self._levelled,
            shadow_share=self._shadow_share,
            thickness_mm=self.context.gel.thickness_mm or THICKNESS_MM,
        )
        return height_map(height_mm, gradients, self.context)
