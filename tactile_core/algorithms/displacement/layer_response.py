"""Displacement of a bonded elastic layer under a traction on a grid, by matrix products.

A transform of a grid this small is faster as a product with the matrix of its waves: only the nodes
in the image are computed, and matrix products use all of the processor.
"""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Complex64, Float32, Float64
from tactile_core.algorithms.elasticity import Elastomer

# Components that are even functions along y, which come first, and all components.
EVEN, COMPONENTS = 4, 7


class LayerResponse:
    """Displacements of a layer under one traction: uniform, and proportional to the position.

    The components are, with the displacement G_ij along i at the offset Δ from a unit traction
    along j::

        G_xx, G_yy, Δy G_xy − Δx G_yy, −Δx G_xx − Δy G_xy, G_xy, Δy G_xx − Δx G_xy,
        −Δx G_xy − Δy G_yy

    each convolved with the traction t. With them x G ∗ t − (Δx G) ∗ t is the displacement under the
    traction x t, and likewise with y, so that one transform of t is enough.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns of the traction, both even. The grid is periodic.
    inside : (slice, slice)
        Nodes at which the displacement is computed.
    cell_mm : (float, float)
        Width and height of a cell.
    elastomer : Elastomer
        The result depends on its thickness and Poisson's ratio, not on its modulus.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        inside: tuple[slice, slice],
        *,
        cell_mm: tuple[float, float],
        elastomer: Elastomer,
    ) -> None:
        rows, columns = shape
        self._response = _response(shape, cell_mm, elastomer)
        # along y waves are real, cosines and sines, and along x complex
        to_y, to_x = (_waves(count) for count in shape)
        self._from_rows = np.ascontiguousarray(to_y.reshape(-1, rows), np.float32)
        complex_x = np.stack([to_x[0], -to_x[1]], axis=1).reshape(-1, columns)
        self._from_columns = np.ascontiguousarray(complex_x.T, np.float32)
        to_y, to_x = (_weighted(side) for side in (to_y, to_x))
        to_rows = to_y.reshape(-1, rows).T[inside[0]]
        to_columns = np.stack([to_x[0], -to_x[1]], axis=1).reshape(-1, columns)[:, inside[1]]
        self._to_rows = np.ascontiguousarray(to_rows, np.float32)
        self._to_columns = np.ascontiguousarray(to_columns, np.float32)
        # kept, because new memory of this size is costly
        self._spectra = np.empty(self._response.shape, np.complex64)

    def displaced(self, traction: Float32) -> Float32:
        """Return the components inside, (7, rows, columns), for a traction on the whole grid."""
        spectrum = (self._from_rows @ traction @ self._from_columns).view(np.complex64)
        spectrum = spectrum.reshape(2, -1, spectrum.shape[1])
        np.multiply(self._response[:EVEN], spectrum, out=self._spectra[:EVEN])
        # an odd function along y exchanges cosines and sines
        np.multiply(self._response[EVEN:], spectrum[::-1], out=self._spectra[EVEN:])
        waves = self._spectra.view(np.float32).reshape(COMPONENTS, -1, self._to_columns.shape[0])
        return np.asarray(self._to_rows @ waves @ self._to_columns)


def _waves(count: int) -> Float64:
    """Cosines and sines (2, count / 2 + 1, count) of a periodic line."""
    phase = 2 * np.pi / count * np.arange(count // 2 + 1)[:, None] * np.arange(count)
    return np.stack([np.cos(phase), np.sin(phase)])


def _weighted(waves: Float64) -> Float64:
    """Scale waves so that they add up to the values of which they are the transform."""
    weight = np.full((waves.shape[1], 1), 2.0)
    weight[0] = weight[-1] = 1.0
    return np.asarray(waves * weight / waves.shape[2])


def _response(
    shape: tuple[int, int], cell_mm: tuple[float, float], elastomer: Elastomer
) -> Complex64:
    """Response (7, 2, ky, kx) of each component to cosines and sines along y."""
    (rows, columns), (width_mm, height_mm) = shape, cell_mm
    kx = 2 * np.pi * np.fft.rfftfreq(columns, width_mm)[None, :]
    ky = 2 * np.pi * np.fft.fftfreq(rows, height_mm)[:, None]
    k = np.hypot(kx, ky)
    cos, sin = (np.divide(side, k, out=np.zeros_like(k), where=k > 0) for side in (kx, ky))
    found = elastomer.compliance(k)
    along, across = (part / found.across[0, 0] for part in (found.along, found.across))
    xx, yy = along * cos**2 + across * sin**2, along * sin**2 + across * cos**2
    xx[0, 0] = yy[0, 0] = 1.0
    xy = (along - across) * cos * sin
    xy[rows // 2] = xy[:, -1] = 0.0
    g_xx, g_xy, g_yy = (np.fft.irfft2(part, s=shape) for part in (xx, xy, yy))
    x, y = width_mm * _offsets(columns), height_mm * _offsets(rows)[:, None]
    turned = y * g_xy - x * g_yy, y * g_xx - x * g_xy
    spread = -x * g_xx - y * g_xy, -x * g_xy - y * g_yy
    even, odd = (
        np.fft.rfft2(np.stack(parts))[:, : rows // 2 + 1]
        for parts in ((g_xx, g_yy, turned[0], spread[0]), (g_xy, turned[1], spread[1]))
    )
    parts = np.stack([even, even], axis=1), np.stack([-1j * odd, 1j * odd], axis=1)
    return np.concatenate(parts).astype(np.complex64)


def _offsets(count: int) -> Float64:
    """Offsets (count,) of the nodes of a periodic line from the first one; 0 halfway round."""
    offsets = np.fft.fftfreq(count, 1 / count)
    offsets[count // 2] = 0.0
    return np.asarray(offsets)
