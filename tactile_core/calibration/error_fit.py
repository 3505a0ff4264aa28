"""The size of a calibration's errors, from measurements of held-out surfaces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactile_core.algorithms.levelling import set_to_rest
from tactile_core.algorithms.poisson.propagation import height_std
from tactile_core.algorithms.slope_errors import ERRORS, error_table, slope_std
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.slope_errors import SlopeErrors
from tactile_core.quantities import Bool, Float32


class FIT:
    """Parameters of the fit. Nothing sets them from outside."""

    # [count] With fewer pixels of undeformed gel the correlation length comes from the contacts.
    # Source: by hand, a hundred values give a quantile within a tenth.
    min_undeformed = 100


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
    gain_std = float(np.quantile(np.abs(np.subtract(gains, 1)), ERRORS.within_one_std))
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
    if len(ratios) < FIT.min_undeformed and contact:
        ratios = np.concatenate(contact)
    if not len(ratios):
        return assumed_mm
    return assumed_mm * float(np.quantile(ratios, ERRORS.within_one_std))
