"""Cosine transform (DCT-II) of rows by OpenCV's real DFT.

Order the samples with the even ones first and the odd ones reversed behind them. A real DFT of the
same length then holds the coefficients k and N − k as real and imaginary part of its entry k, up
to a rotation by πk/2N [1]_. The coefficients stay in this packed order: a diagonal operator only
needs their frequencies.

References
----------
.. [1] J. Makhoul, "A fast cosine transform in one and two dimensions", IEEE Transactions on
   Acoustics, Speech, and Signal Processing 28(1), 1980.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.arrays.types import Array


def in_dft_order(lines: Array, out: Array) -> None:
    """Write the even lines first and the odd ones reversed behind them."""
    half = (len(lines) + 1) // 2
    out[:half] = lines[::2]
    out[half:] = lines[1::2][::-1]


def from_dft_order(ordered: Array, out: Array) -> None:
    """Undo :func:`in_dft_order`."""
    half = (len(ordered) + 1) // 2
    out[::2] = ordered[:half]
    out[1::2] = ordered[half:][::-1]


class CosineRows:
    """The DCT-II of rows of one length and its inverse, up to the sign of the coefficients.

    Attributes
    ----------
    length : int
        N, the number of samples.
    frequencies : (N,) int
        Frequency of each packed coefficient.
    turn : (P,) complex
        Rotations from pairs of the DFT to pairs of coefficients.
    """

    def __init__(self, length: int, dtype: DTypeLike) -> None:
        self.length = length
        pairs = np.arange(1, (length + 1) // 2)
        self.frequencies = np.zeros(length, int)
        self.frequencies[1 : 2 * len(pairs) : 2] = pairs
        self.frequencies[2 : 2 * len(pairs) + 1 : 2] = length - pairs
        if length % 2 == 0:
            self.frequencies[-1] = length // 2
        kind = np.result_type(dtype, np.complex64)
        self.turn = np.exp(-0.5j * np.pi * pairs / length).astype(kind)
        self._whole_turn = np.ones(length // 2 + 1, kind)
        self._whole_turn[1 : 1 + len(pairs)] = self.turn
        self._whole_back = self._whole_turn.conj()

    @property
    def room(self) -> int:
        """Entries in a row of memory for the coefficients, one or two more than N.

        numpy multiplies whole complex arrays twice as fast as slices. So a row is long enough to be
        viewed as complex numbers, and coefficients without a partner are rotated by 1.
        """
        return 2 * len(self._whole_turn)

    def coefficients(self, memory: Array) -> Array:
        """Return the (M, N) view of an (M, ``room``) array, in the order of ``frequencies``."""
        return memory[:, 1 : self.length + 1]

    def forward(self, rows: Array, memory: Array) -> None:
        """Transform (M, N) rows, their samples in DFT order, into ``memory`` (M, ``room``)."""
        memory[:, 0] = memory[:, -1] = 0
        cv2.dft(rows, dst=self.coefficients(memory), flags=cv2.DFT_ROWS)
        _multiply(memory, self._whole_turn)

    def backward(self, memory: Array, rows: Array) -> None:
        """Write N times the rows with these coefficients; overwrites ``memory``."""
        _multiply(memory, self._whole_back)
        cv2.dft(self.coefficients(memory), dst=rows, flags=cv2.DFT_ROWS | cv2.DFT_INVERSE)


def _multiply(memory: Array, turn: Array) -> None:
    entries = memory.view(turn.dtype)
    np.multiply(entries, turn, out=entries)
