"""What loads on nodes do to the nodes, where only their distance counts: Fourier transforms."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.algorithms.arrays.types import Array


class Symbols(NamedTuple):
    """Displacement for each unit of traction at the waves of a real transform, mm/MPa.

    Attributes
    ----------
    normal, xx, yy, xy : (ny, nx // 2 + 1)
        Indentation by pressure; x by x, y by y, and x by y or y by x, along the surface.
    coupling : (2, ny, nx // 2 + 1)
        x and y by pressure, times i.
    """

    normal: Array
    coupling: Array
    xx: Array
    yy: Array
    xy: Array


class Response:
    """From loads on nodes to their displacements; periodic.

    Loads may be given on fewer nodes, the first of each row and column, and displacements are then
    told for these.

    Parameters
    ----------
    shape : (ny, nx)
    symbols : Symbols
    dtype : float32 or float64
        In which everything is computed.
    """

    def __init__(self, shape: tuple[int, int], symbols: Symbols, dtype: DTypeLike) -> None:
        self.shape, self.dtype = shape, np.dtype(dtype)
        self._symbols = Symbols(*(part.astype(self.dtype) for part in symbols))

    def indentation(self, pressure: Array) -> Array:
        """(ny, nx) indentation in mm under a pressure (ny, nx) in MPa alone."""
        return self._back(self._symbols.normal * self._forth(pressure), pressure)

    def shift(self, traction: Array) -> Array:
        """(2, ny, nx) tangential displacement in mm under a shear traction (2, ny, nx) alone."""
        waves = self._forth(traction)
        return self._back(_turned(waves, *self._symbols[2:]), traction)

    def spread(self, pressure: Array) -> Array:
        """(2, ny, nx) tangential displacement under a pressure alone: outwards."""
        return self._back(self._symbols.coupling * (-1j * self._forth(pressure)), pressure)

    def bulge(self, traction: Array) -> Array:
        """(ny, nx) indentation under a shear traction alone."""
        x, y = 1j * self._forth(traction)
        along, down = self._symbols.coupling
        return self._back(along * x + down * y, traction)

    def displacement(self, traction: Array, pressure: Array) -> Array:
        """(3, ny, nx) of all loads: :meth:`shift` and :meth:`spread`, then the indentation."""
        normal, (along, down), *shear = self._symbols
        loads = self._forth(np.concatenate([traction, pressure[None]]))
        x, y, turned = *loads[:2], 1j * loads[2]
        waves = np.empty_like(loads)
        waves[:2] = _turned(loads, *shear)
        waves[0] -= along * turned
        waves[1] -= down * turned
        waves[2] = normal * loads[2] + 1j * (along * x + down * y)
        return self._back(waves, pressure)

    def resolvent(self, rho: float, stiffening: float = 1.0) -> Resolvent:
        """Return the solver of (C / stiffening + rho) q = b for a traction, C being :meth:`shift`.

        Parameters
        ----------
        rho : float
            mm/MPa.
        stiffening : float
            How much stiffer than its symbols say the layer is.
        """
        xx, yy, xy = (part / stiffening for part in self._symbols[2:])
        xx, yy = xx + rho, yy + rho
        determinant = xx * yy - xy**2
        return Resolvent(self, yy / determinant, xx / determinant, -xy / determinant)

    @cached_property
    def typical_shift(self) -> float:
        """Geometric mean of the softest and the stiffest wave's tangential compliance, mm/MPa."""
        values = self._symbols.xx[self._symbols.xx > 0]
        return float(np.sqrt(values.max() * values.min()))

    @cached_property
    def softest(self) -> float:
        """Largest indentation for each unit of pressure in any wave, mm/MPa."""
        return float(self._symbols.normal.max())

    def _cut(self, shape: tuple[int, int]) -> Response:
        """Return the response of fewer nodes, as far apart, up to half of their number."""
        from scipy.fft import rfft2

        rows, columns = (
            np.r_[: (part + 1) // 2, all_of - part // 2 : all_of]
            for part, all_of in zip(shape, self.shape, strict=True)
        )
        along, down = 1j * self._symbols.coupling
        even = [self._symbols.normal, self._symbols.xx, self._symbols.yy]
        found = []
        for symbol, odd_x, odd_y in [
            *((part, False, False) for part in even),
            (self._symbols.xy, True, True),
            (along, True, False),
            (down, False, True),
        ]:
            between = self._back(symbol.astype(self._complex), np.empty(self.shape))
            part = between[np.ix_(rows, columns)]
            # half way round is as far one way as the other
            if odd_x and shape[1] % 2 == 0 and shape[1] < self.shape[1]:
                part[:, shape[1] // 2] = 0
            if odd_y and shape[0] % 2 == 0 and shape[0] < self.shape[0]:
                part[shape[0] // 2] = 0
            waves = rfft2(part, workers=1)
            found.append(waves.imag if odd_x != odd_y else waves.real)
        normal, xx, yy, xy, along, down = found
        return Response(shape, Symbols(normal, np.stack([along, down]), xx, yy, xy), self.dtype)

    @property
    def _complex(self) -> np.dtype[Any]:
        return np.result_type(self.dtype, np.complex64)

    def _forth(self, field: Array) -> NDArray[Any]:
        from scipy.fft import rfft2

        # to be told the shape that it has anyway costs it more than a small transform
        shape = None if field.shape[-2:] == self.shape else self.shape
        return np.asarray(rfft2(field.astype(self.dtype, copy=False), s=shape, workers=1))

    def _back(self, waves: NDArray[Any], like: Array) -> Array:
        from scipy.fft import irfft2

        rows, columns = like.shape[-2:]
        return np.asarray(irfft2(waves, s=self.shape, workers=1)[..., :rows, :columns])


class Resolvent:
    """Solves (C / stiffening + rho) q = b in one pair of transforms; see :class:`Response`."""

    def __init__(self, response: Response, xx: Array, yy: Array, xy: Array) -> None:
        self._response, self._xx, self._yy, self._xy = response, xx, yy, xy

    def __call__(self, wanted: Array) -> Array:
        """(2, ny, nx) traction that answers this displacement (2, ny, nx), of all nodes."""
        waves = self._response._forth(wanted)
        return self._response._back(_turned(waves, self._xx, self._yy, self._xy), wanted)


def _turned(waves: NDArray[Any], xx: Array, yy: Array, xy: Array) -> NDArray[Any]:
    x, y = waves[:2]
    out = np.empty((2, *x.shape), x.dtype)
    np.multiply(xx, x, out=out[0])
    out[0] += xy * y
    np.multiply(xy, x, out=out[1])
    out[1] += yy * y
    return out
