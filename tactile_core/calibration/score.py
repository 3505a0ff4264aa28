"""The score of a calibration, and the fit of its errors by the slope."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from tactile_core.algorithms.arrays.regression import ONE_SIGMA
from tactile_core.algorithms.heights.levelling import set_to_rest
from tactile_core.algorithms.poisson.integration import height_std
from tactile_core.algorithms.slopes.slope_field import error_table, slope_std
from tactile_core.calibration.target_surface import MeasuredSphere
from tactile_core.interfaces.calibration import Press, SlopeErrors
from tactile_core.quantities import Bool, Float32


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
        said.append(
            f"held-out normal error: mean {self.mean_deg:.2f}°, median {self.median_deg:.2f}°, "
            f"90 % {self.p90_deg:.2f}° (predicting 'flat': {self.predict_flat_deg:.1f}°), on "
            f"slopes up to {coverage['slope_deg_max']:.0f}° in {coverage['image_fraction']:.0%} of "
            f"the image"
        )
        return said

    def summary(self) -> dict[str, Any]:
        """Return the ``held_out`` entry of ``tactile calibrate --json``."""
        ratio = self.left_out_size_ratio
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
            "left_out_size_ratio": None if ratio is None else round(ratio, 4),
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


@dataclass(frozen=True, eq=False)
class HeldOutSurface:
    """Measured slopes and heights of one held-out surface, at pixels with ground truth.

    Attributes
    ----------
    gx, gy : (H, W) float32
        Measured slopes of the whole frame.
    height_mm : (H, W) float32
        The height that was integrated from them.
    truth : Press
        Pixels with true slopes and heights.
    thickness_mm : float
        Thickness of the gel.
    """

    gx: Float32
    gy: Float32
    height_mm: Float32
    truth: Press
    thickness_mm: float

    @property
    def slopes(self) -> Float32:
        """(N, 2) measured slopes."""
        at = self.truth.rows, self.truth.columns
        return np.stack([self.gx[at], self.gy[at]], axis=1)

    @property
    def undeformed(self) -> Bool:
        """(N,) bool: pixels whose true height and slope are 0."""
        heights_mm = self.truth.heights_mm
        flat: Bool = ~np.any(self.truth.gradients, axis=1)
        return flat if heights_mm is None else flat & np.equal(heights_mm, 0)

    @cached_property
    def levelled_mm(self) -> Float32:
        """(H, W) height above the undeformed surface."""
        height_mm = self.height_mm.copy()
        set_to_rest(
            height_mm,
            self.gx,
            self.gy,
            mm_per_px=self.truth.frame.mm_per_px,
            thickness_mm=self.thickness_mm,
        )
        return height_mm


def fitted_errors(surfaces: Iterable[HeldOutSurface]) -> SlopeErrors | None:
    """Return the size of a calibration's errors; None without pixels.

    Parameters
    ----------
    surfaces : iterable of HeldOutSurface
        Each measured by a calibration that has not seen it.
    """
    surfaces = [surface for surface in surfaces if len(surface.truth.rows)]
    if not surfaces:
        return None
    found = np.concatenate([surface.slopes for surface in surfaces])
    true = np.concatenate([surface.truth.gradients for surface in surfaces])
    slopes, std = error_table(np.hypot(found[:, 0], found[:, 1]), found - true)
    gains = [gain for surface in surfaces if (gain := _gain(surface)) is not None]
    gain_std = float(np.quantile(np.abs(np.subtract(gains, 1)), ONE_SIGMA))
    return SlopeErrors(slopes, std, gain_std, _correlation_mm(surfaces, slopes, std))


def _gain(surface: HeldOutSurface) -> float | None:
    """Regress measured on true slopes of a contact, through the origin.

    Heights would serve as well, but the height of a ball's contact is known only to a tenth.
    """
    contact = ~surface.undeformed
    found, true = surface.slopes[contact], surface.truth.gradients[contact]
    size = float(np.square(true, dtype=np.float64).sum())
    return float((found * true).sum(dtype=np.float64)) / size if size else None


def _correlation_mm(surfaces: list[HeldOutSurface], slopes: Float32, std: Float32) -> float:
    """Choose the correlation length with which propagated errors are as large as observed ones.

    Propagated errors are nearly proportional to it.
    """
    assumed_mm = 1.0
    far, contact = list[np.ndarray](), list[np.ndarray]()
    for surface in surfaces:
        at = surface.truth.rows, surface.truth.columns
        cells = slope_std(surface.gx, surface.gy, slopes, std)
        scale, shape = surface.truth.frame.mm_per_px, surface.gx.shape
        cell_mm = (scale * shape[0] / cells.shape[0], scale * shape[1] / cells.shape[1])
        predicted = height_std(cells, cell_mm, assumed_mm)
        row, column = (
            np.asarray(where * count // size)
            for where, count, size in zip(at, cells.shape, shape, strict=True)
        )
        undeformed = surface.undeformed
        expected_mm = predicted[row, column]
        height_mm = surface.levelled_mm[at]
        far.append((np.abs(height_mm) / expected_mm)[undeformed])
        if surface.truth.heights_mm is not None:
            error_mm = (height_mm - surface.truth.heights_mm)[~undeformed]
            contact.append(np.abs(error_mm - np.median(error_mm)) / expected_mm[~undeformed])
    ratios = np.concatenate(far)
    # [count] With fewer pixels of undeformed gel the correlation length comes from the contacts.
    # Source: by hand, a hundred values give a quantile within a tenth.
    if len(ratios) < 100 and contact:
        ratios = np.concatenate(contact)
    if not len(ratios):
        return assumed_mm
    return assumed_mm * float(np.quantile(ratios, ONE_SIGMA))
