"""The score of a calibration: errors on what it was not fitted on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tactile_core.calibration.target_surface import MeasuredSphere
from tactile_core.interfaces.slope_errors import SlopeErrors


@dataclass(frozen=True, eq=False)
class Score:
    """Held-out errors of a calibration.

    Attributes
    ----------
    presses : int
        Number of scored presses.
    mean_deg, median_deg, p90_deg : float
        Angle between measured and true normals, in degrees, over pixels within 0.8 of the contact
        radius, or over all of a height map.
    predict_flat_deg : float
        Baseline: the mean error of a prediction of level gel everywhere.
    height_rmse_mm : float
        Root-mean-square error of the height over the same pixels, integrated from slopes or as
        measured. What slopes leave undetermined is removed: a constant, and for a height map its
        tilt.
    samples : (N, 4) float32
        Measured and true slopes of a sample of pixels, for the report.
    errors : SlopeErrors or None
        Size of the errors against the measured slope; None if heights are measured directly.
    spheres : mapping of int to MeasuredSphere
        Spheres fitted to the height maps of the held-out balls, by the number of the surface. They
        depend on the circles only through the calibration. Empty for other targets.
    halves_difference_deg : float or None
        Mean angle between the normals that calibrations on two disjoint halves of the surfaces
        measure, over the pixels of the score; None with fewer than four surfaces.
    left_out_size_ratio : float or None
        Median of such ratios for the balls of one size, measured with a calibration on the other
        sizes; the worst of all sizes, None for a single size.
    """

    presses: int
    mean_deg: float
    median_deg: float
    p90_deg: float
    predict_flat_deg: float
    height_rmse_mm: float
    samples: np.ndarray
    errors: SlopeErrors | None = None
    spheres: Mapping[int, MeasuredSphere] = field(default_factory=dict)
    halves_difference_deg: float | None = None
    left_out_size_ratio: float | None = None

    def sentences(self, coverage: Mapping[str, float]) -> list[str]:
        """Return the score in words: first what the circles cannot flatter, then the normals.

        Parameters
        ----------
        coverage : mapping
            As in the summary of a :class:`~tactile_core.calibration.result.Calibrated`.
        """
        said = []
        radii, offsets = self.sphere_quartiles(), self.sphere_offsets_px()
        if radii is not None and offsets is not None:
            said.append(
                f"spheres in {len(self.spheres)} held-out height maps: radius {radii[1]:.3f} of "
                f"the ball's (quartiles {radii[0]:.3f} and {radii[2]:.3f}), centre "
                f"{offsets[0]:.1f} px from the circle's (90 %: {offsets[1]:.1f} px)"
            )
        if self.left_out_size_ratio is not None:
            said.append(
                f"a size of ball that was left out: radius {self.left_out_size_ratio:.3f} of the "
                f"ball's"
            )
        if self.halves_difference_deg is not None:
            said.append(
                f"calibrations on two halves of the presses: normals differ by "
                f"{self.halves_difference_deg:.2f}°"
            )
        said.append(
            f"held-out normal error: mean {self.mean_deg:.2f}°, median {self.median_deg:.2f}°, "
            f"90 % {self.p90_deg:.2f}° (predicting 'flat': {self.predict_flat_deg:.1f}°), on "
            f"slopes up to {coverage['slope_deg_max']:.0f}° in {coverage['image_fraction']:.0%} of "
            f"the image"
        )
        return said

    def summary(self) -> dict[str, Any]:
        """Return the ``held_out`` entry of ``tactile calibrate --json``."""
        return {
            "presses": self.presses,
            "normal_error_deg": {
                "mean": round(self.mean_deg, 4),
                "median": round(self.median_deg, 4),
                "p90": round(self.p90_deg, 4),
            },
            "predict_flat_deg": round(self.predict_flat_deg, 4),
            "height_rmse_mm": round(self.height_rmse_mm, 6),
            "sphere_radius_ratio": self._radii(),
            "sphere_offset_px": self._offsets(),
            "halves_difference_deg": _rounded(self.halves_difference_deg),
            "left_out_size_ratio": _rounded(self.left_out_size_ratio),
        }

    def sphere_quartiles(self) -> tuple[float, float, float] | None:
        """Return the quartiles of the radii of the spheres over the balls'; None without any."""
        ratios = [sphere.radius_ratio for sphere in self.spheres.values()]
        if not ratios:
            return None
        low, median, high = np.percentile(ratios, (25, 50, 75))
        return float(low), float(median), float(high)

    def sphere_offsets_px(self) -> tuple[float, float] | None:
        """Return median and 90th percentile of the offsets of the spheres; None without any."""
        offsets = [sphere.offset_px for sphere in self.spheres.values()]
        if not offsets:
            return None
        median, high = np.percentile(offsets, (50, 90))
        return float(median), float(high)

    def _radii(self) -> dict[str, float] | None:
        quartiles = self.sphere_quartiles()
        if quartiles is None:
            return None
        low, median, high = quartiles
        return {"median": round(median, 4), "iqr": round(high - low, 4)}

    def _offsets(self) -> dict[str, float] | None:
        offsets = self.sphere_offsets_px()
        if offsets is None:
            return None
        return {"median": round(offsets[0], 3), "p90": round(offsets[1], 3)}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)
