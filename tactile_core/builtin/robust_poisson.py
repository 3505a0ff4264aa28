"""``core.robust_poisson``: height from slopes with outliers, relative to the rest surface."""

from __future__ import annotations

from pydantic import BaseModel, Field, NonNegativeFloat, PositiveInt

from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.algorithms.levelling import set_to_rest
from tactile_core.algorithms.poisson import integrate_robustly
from tactile_core.builtin.poisson import (
    DRIFT_SLOPE,
    DriftSlope,
    Levelled,
    height_map,
    relative_to,
)
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import Gradients, HeightMap, ReferenceGradients


class RobustPoisson(Estimator):
    """Integrates the slopes robustly against outliers, such as shadows and markers.

    Use it in place of ``core.poisson`` where slopes are inconsistent: an attached shadow on one
    flank, highlights, dust, markers. It takes about ten times as long. The border is free, and the
    undeformed surface is set to 0 as in :class:`~tactile_core.builtin.poisson.Poisson`. For the
    method see :func:`tactile_core.algorithms.poisson.integrate_robustly`.

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

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        assert isinstance(options, self.Options)
        self._outlier_slope = options.outlier_slope
        self._rounds = options.rounds
        self._drift_slope = options.drift_slope
        self._levelled = options.levelled

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
            thickness_mm=self.context.gel.thickness_mm or THICKNESS_MM,
        )
        return height_map(height_mm, gradients, self.context)
