"""The elastic response of the layer on a grid."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.algorithms.arrays.types import Array


class WaveProducts(NamedTuple):
    """Transforms of fields (m, n) in the first rows and columns of a grid (M, N), zero elsewhere.

    They cost more operations than the fast transform, but no padding, and only values in the part
    are transformed back: below some 80 nodes that is faster.

    Attributes
    ----------
    across : (n, 2 h) real
        From columns to h = N // 2 + 1 complex waves along x, real and imaginary parts by turns.
    down : (M, m) complex
        From rows to waves along y.
    up : (m, M) complex
        Back from waves along y to rows.
    back : (2 h, n) real
        Back from complex waves along x to columns.
    """

    across: Array
    down: NDArray[Any]
    up: NDArray[Any]
    back: Array

    @classmethod
    def for_part(
        cls, part: tuple[int, int], whole: tuple[int, int], dtype: DTypeLike
    ) -> WaveProducts:
        """Prepare the transforms of a part (m, n) of a grid (M, N)."""
        (rows, columns), (all_rows, all_columns) = part, whole
        half = all_columns // 2 + 1
        along_x = _waves(half, columns, all_columns)
        down = _waves(all_rows, rows, all_rows)
        # waves between zero and Nyquist stand for their mirror images, too
        twice = np.full(half, 2.0)
        twice[0] = 1
        if all_columns % 2 == 0:
            twice[-1] = 1
        back = along_x * (twice / (all_rows * all_columns))[:, None]
        across = np.ascontiguousarray(along_x.T).view(np.float64)
        complex_type = np.result_type(dtype, np.complex64)
        return cls(
            across.astype(dtype),
            down.astype(complex_type),
            np.ascontiguousarray(down.conj().T).astype(complex_type),
            np.stack([back.real, back.imag], 1).reshape(2 * half, columns).astype(dtype),
        )

    def forward(self, field: Array) -> NDArray[Any]:
        """(..., M, h) complex waves of a field (..., m, n)."""
        return np.asarray(self.down @ (field @ self.across).view(self.down.dtype))

    def inverse(self, waves: NDArray[Any]) -> Array:
        """(..., m, n) field of waves (..., M, h), in the part only."""
        return np.asarray((self.up @ waves).view(self.back.dtype) @ self.back)


def _waves(waves: int, nodes: int, period: int) -> NDArray[np.complex128]:
    """(waves, nodes) values of exp(-i k x)."""
    turns = np.outer(np.arange(waves), np.arange(nodes)) / period
    return np.asarray(np.exp(-2j * np.pi * turns))


# [nodes] Longest side of a grid on which a part of at most half its size is transformed by products
# with matrices: measured in single precision: 14 µs instead of 30 there and back on 48 × 48 nodes,
# 39 instead of 49 on 80 × 80, 58 instead of 62 on 96 × 96
_LARGEST_PRODUCT = 80


class Symbols(NamedTuple):
    """Fourier-space compliances at the wave numbers of a real transform, mm/MPa.

    Attributes
    ----------
    normal : (ny, nx // 2 + 1)
        Indentation per pressure.
    coupling : (2, ny, nx // 2 + 1)
        x and y displacement per pressure, times i.
    xx, yy, xy : (ny, nx // 2 + 1)
        Tangential displacement per shear traction; xy is symmetric.
    """

    normal: Array
    coupling: Array
    xx: Array
    yy: Array
    xy: Array


class Response:
    """Linear map from loads on nodes to displacements of the nodes; periodic.

    Loads may cover only the first rows and columns of the grid. Displacements are then returned
    for the same nodes.

    Parameters
    ----------
    shape : (ny, nx)
    symbols : Symbols
    dtype : float32 or float64
        Type of all computations.

    References
    ----------
    .. [1] Stanley, Kato, "An FFT-Based Method for Rough Surface Contact", Journal of Tribology 119,
       1997.
    """

    def __init__(self, shape: tuple[int, int], symbols: Symbols, dtype: DTypeLike) -> None:
        self.shape, self.dtype = shape, np.dtype(dtype)
        self._symbols = Symbols(*(part.astype(self.dtype) for part in symbols))
        # real and imaginary parts of a wave have the same factor: products of real numbers take a
        # fraction of the time of complex ones
        self._factors = Symbols(*(np.repeat(part, 2, axis=-1) for part in self._symbols))
        # without a way back to this response: a cycle would keep its arrays until Python looks
        # for cycles, some thousand contacts later
        self._inverses: tuple[tuple[float, float, float], Array] | None = None
        self._part: tuple[tuple[int, int], WaveProducts] | None = None

    def indentation(self, pressure: Array) -> Array:
        """(ny, nx) indentation in mm due to a pressure (ny, nx) in MPa."""
        waves = self._factors.normal * self._real(self._forward(pressure))
        return self._inverse(self._waves(waves), pressure)

    def shift(self, traction: Array) -> Array:
        """(2, ny, nx) tangential displacement in mm due to a shear traction (2, ny, nx)."""
        waves = _tangential(self._real(self._forward(traction)), *self._factors[2:])
        return self._inverse(self._waves(waves), traction)

    def waves(self, loads: Array) -> NDArray[Any]:
        """Return the waves of loads (n, ny, nx), for responses on the same grid."""
        return self._forward(loads)

    def shifts(self, loads: Array, waves: NDArray[Any]) -> tuple[Array, Array, Array]:
        """Return what each of many shear tractions shifts: (xx, yy, xy), each (n, ny, nx) in mm.

        Parameters
        ----------
        loads : (n, ny, nx)
            MPa. A traction along x shifts the surface by xx along x and by xy along y; one along y
            by xy along x and by yy along y.
        waves : array
            Those of the loads.
        """
        parts = self._real(waves)
        xx, yy, xy = (
            self._inverse(self._waves(factor * parts), loads) for factor in self._factors[2:]
        )
        return xx, yy, xy

    def spread(self, pressure: Array) -> Array:
        """(2, ny, nx) tangential displacement due to a pressure: outwards."""
        waves = self._factors.coupling * self._real(-1j * self._forward(pressure))
        return self._inverse(self._waves(waves), pressure)

    def bulge(self, traction: Array) -> Array:
        """(ny, nx) indentation due to a shear traction."""
        x, y = self._real(1j * self._forward(traction))
        along, down = self._factors.coupling
        return self._inverse(self._waves(along * x + down * y), traction)

    def displacement(self, traction: Array, pressure: Array) -> Array:
        """(3, ny, nx) displacement due to all loads: x, y and indentation."""
        normal, (along, down), *shear = self._factors
        loads = self._forward(np.concatenate([traction, pressure[None]]))
        parts, (x, y, pressure_i) = self._real(loads), self._real(1j * loads)
        waves = np.empty_like(parts)
        waves[:2] = _tangential(parts, *shear)
        waves[0] -= along * pressure_i
        waves[1] -= down * pressure_i
        np.multiply(normal, parts[2], out=waves[2])
        waves[2] += along * x
        waves[2] += down * y
        return self._inverse(self._waves(waves), pressure)

    def resolvent(self, rho: float, stiffening: float = 1.0, *, gain: float = 1.0) -> Resolvent:
        """Return the solver of (C / stiffening + rho) q = gain b, where C is :meth:`shift`.

        The last one's factors are kept.

        Parameters
        ----------
        rho : float
            Regularisation, mm/MPa.
        stiffening : float
            Stiffness of the layer relative to that of its symbols.
        gain : float
            Factor on the displacement.
        """
        key = rho, stiffening, gain
        known = self._inverses
        if known is None or known[0] != key:
            xx, yy, xy = (part / stiffening for part in self._symbols[2:])
            xx, yy = xx + rho, yy + rho
            share = gain / (xx * yy - xy**2)
            # real and imaginary parts of a wave have the same factor
            inverses = np.stack([yy * share, xx * share, -xy * share]).astype(
                self.dtype, copy=False
            )
            known = self._inverses = key, np.repeat(inverses, 2, axis=-1)
        return Resolvent(self, *known[1])

    @cached_property
    def typical_shift(self) -> float:
        """Geometric mean of the largest and smallest tangential compliance, mm/MPa."""
        values = self._symbols.xx[self._symbols.xx > 0]
        return float(np.sqrt(values.max() * values.min()))

    @cached_property
    def softest(self) -> float:
        """Largest normal compliance of any wave, mm/MPa."""
        return float(self._symbols.normal.max())

    def _crop_response(self, shape: tuple[int, int]) -> Response:
        """Return the response on a smaller grid of equal spacing, exact to half its size."""
        from scipy.fft import rfft2

        rows, columns = (
            np.r_[: (part + 1) // 2, all_of - part // 2 : all_of]
            for part, all_of in zip(shape, self.shape, strict=True)
        )
        along, down = 1j * self._symbols.coupling
        even = [self._symbols.normal, self._symbols.xx, self._symbols.yy]
        cropped = []
        for symbol, odd_x, odd_y in [
            *((part, False, False) for part in even),
            (self._symbols.xy, True, True),
            (along, True, False),
            (down, False, True),
        ]:
            kernel = self._inverse(symbol.astype(self._complex), np.empty(self.shape))
            part = kernel[np.ix_(rows, columns)]
            # half a period away, an odd kernel has no sign
            if odd_x and shape[1] % 2 == 0 and shape[1] < self.shape[1]:
                part[:, shape[1] // 2] = 0
            if odd_y and shape[0] % 2 == 0 and shape[0] < self.shape[0]:
                part[shape[0] // 2] = 0
            waves = rfft2(part, workers=1)
            cropped.append(waves.imag if odd_x != odd_y else waves.real)
        normal, xx, yy, xy, along, down = cropped
        return Response(shape, Symbols(normal, np.stack([along, down]), xx, yy, xy), self.dtype)

    @cached_property
    def _complex(self) -> np.dtype[Any]:
        return np.result_type(self.dtype, np.complex64)

    def _real(self, waves: NDArray[Any]) -> Array:
        """Real and imaginary parts of waves by turns."""
        return waves.view(self.dtype)

    def _waves(self, parts: Array) -> NDArray[Any]:
        """Waves of real and imaginary parts by turns."""
        return parts.view(self._complex)

    def _forward(self, field: Array) -> NDArray[Any]:
        field = field.astype(self.dtype, copy=False)
        products = self._products(field.shape[-2:])
        if products is not None:
            return products.forward(field)
        from scipy.fft import rfft2

        # an explicit shape, even if unchanged, costs more than a small transform
        shape = None if field.shape[-2:] == self.shape else self.shape
        return np.asarray(rfft2(field, s=shape, workers=1))

    def _inverse(self, waves: NDArray[Any], like: Array) -> Array:
        rows, columns = like.shape[-2:]
        products = self._products((rows, columns))
        if products is not None:
            return products.inverse(waves)
        from scipy.fft import irfft2

        # as above; the default shape is that of an even number of columns
        shape = None if self.shape[1] % 2 == 0 else self.shape
        return np.asarray(irfft2(waves, s=shape, workers=1)[..., :rows, :columns])

    def _products(self, part: tuple[int, ...]) -> WaveProducts | None:
        """Transforms of a part by products, if they are faster; the last ones are kept."""
        rows, columns = part
        small = max(self.shape) <= _LARGEST_PRODUCT
        if not small or 2 * rows > self.shape[0] or 2 * columns > self.shape[1]:
            return None
        if self._part is None or self._part[0] != part:
            products = WaveProducts.for_part((rows, columns), self.shape, self.dtype)
            self._part = (rows, columns), products
        return self._part[1]


class Resolvent:
    """Solver of (C / stiffening + rho) q = gain b in one pair of transforms; see Response."""

    def __init__(self, response: Response, xx: Array, yy: Array, xy: Array) -> None:
        self._response = response
        self._xx, self._yy, self._xy = xx, yy, xy

    def __call__(self, displacement: Array) -> Array:
        """(2, ny, nx) traction for a displacement b (2, ny, nx) of all nodes."""
        waves = self._response._forward(displacement)
        x, y = self._response._real(waves)
        across = self._xy * x
        x *= self._xx
        x += self._xy * y
        y *= self._yy
        y += across
        return self._response._inverse(waves, displacement)


def _tangential(parts: Array, xx: Array, yy: Array, xy: Array) -> Array:
    """Apply the symmetric 2 × 2 tensor (xx, yy, xy) to the first two planes."""
    x, y = parts[:2]
    out = np.empty((2, *x.shape), x.dtype)
    np.multiply(xx, x, out=out[0])
    out[0] += xy * y
    np.multiply(xy, x, out=out[1])
    out[1] += yy * y
    return out
