"""Height from slopes, measured from the rest surface."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, Field, NonNegativeFloat

from tactile_core.algorithms.poisson import PoissonSolver
from tactile_core.algorithms.rest_surface import rest_plane
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import Float32, Gradients, HeightMap

DriftSlope = Annotated[
    NonNegativeFloat,
    Field(description="Tilt of the whole map up to which it counts as drift; 0: the level alone."),
]
DRIFT_SLOPE = 0.05


class Poisson(Estimator):
    """Integrates the slopes exactly and sets the untouched skin to 0.

    The solver's free constant is the height of the skin out of contact. With "neumann" a tilt of
    the whole map below ``drift_slope`` is taken for drift of the light and removed as well, since
    no press tilts the skin far from it; see
    :func:`tactile_core.algorithms.rest_surface.rest_plane` for when it is not. "dirichlet" holds
    the border of the image at 0, and nothing is shifted.
    """

    class Options(device.Options):
        """Options of the step."""

        boundary: Literal["neumann", "dirichlet"] = Field(
            default="neumann",
            description="neumann: the border is free; dirichlet: the skin is at rest there.",
        )
        drift_slope: DriftSlope = DRIFT_SLOPE

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        self._boundary = options.boundary
        self._drift_slope = options.drift_slope

    def estimate(self, gradients: Gradients) -> HeightMap:
        """Return the height, 0 at rest and positive where pressed."""
        gx, gy, mm_per_px = gradients.x, gradients.y, gradients.mm_per_px
        solver = PoissonSolver(
            gx.shape,
            mm_per_px=mm_per_px,
            boundary=self._boundary,
            compiled=self.context.compiled,
        )
        height_mm = solver.solve(gx, gy)
        if self._boundary == "neumann":
            set_to_rest(height_mm, gradients, self._drift_slope, self.context.compiled)
        return height_map(height_mm, gradients, self.context)


def height_map(height_mm: Float32, gradients: Gradients, context: SensorContext) -> HeightMap:
    """Return an (H, W) height that was integrated from these slopes as a quantity."""
    return HeightMap(
        height_mm, gradients.valid, gradients.mm_per_px, gradients.timestamp_s, context.rest_mm
    )


def set_to_rest(
    height_mm: Float32, gradients: Gradients, drift_slope: float, compiled: bool
) -> None:
    """Shift the height that was integrated from these slopes; the untouched skin is then at 0.

    See :func:`tactile_core.algorithms.rest_surface.rest_plane`.
    """
    scale = gradients.mm_per_px
    plane = rest_plane(
        height_mm,
        gradients.x,
        gradients.y,
        mm_per_px=scale,
        drift_slope=drift_slope,
        compiled=compiled,
    )
    plane.removed_from(height_mm, scale, out=height_mm)
