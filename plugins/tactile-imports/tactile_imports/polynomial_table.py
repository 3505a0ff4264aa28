"""Taxim's table: the change of colour that a slope causes, at each place of the image.

``polycalib.npz`` has the number of bins and three arrays (bins, bins, 6), ``grad_r``, ``grad_g``
and ``grad_b``. The first axis counts the angle between the gel surface and the image plane, 0 to
π/2, the second the direction of (∂z/∂x, ∂z/∂y), −π to π; both in steps of the range over bins − 1,
heights positive where an object presses. The six numbers are the coefficients of x², y², xy, x, y
and 1, positions in px; their sum is the change of a channel against the undeformed surface, on a
scale of 0 to 255.

Taxim fills the arrays from images in OpenCV's order, so that its ``grad_r`` is blue; Isaac Lab
reads the same arrays as red, green, blue.

References
----------
.. [1] Z. Si and W. Yuan, "Taxim: An Example-based Simulation Model for GelSight Tactile Sensors",
   IEEE Robotics and Automation Letters 7(2), 2022.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.quantities import Float32

Float64 = NDArray[np.float64]
Order = Literal["bgr", "rgb"]

FULL_SCALE = 255.0  # Of the changes in a table
TERMS = 6  # Coefficients of a polynomial of second order in two variables

_ARRAYS = ("grad_r", "grad_g", "grad_b")


@dataclass(frozen=True, eq=False)
class PolynomialTable:
    """Changes of colour by slope and place.

    Attributes
    ----------
    coefficients : (B, B, 3, 6) float64
        By the bins of tilt and direction, the channels red, green and blue, and the terms.
    """

    coefficients: Float64

    @property
    def bins(self) -> int:
        """Number of bins of tilt, and of direction."""
        return len(self.coefficients)

    def slopes(self) -> Float32:
        """Return ∂z/∂x and ∂z/∂y in the middle of each bin, (B, B, 2).

        The last bin of tilt begins at a right angle and stands for it; no gel is as steep.
        """
        tilt, direction = bin_angles(self.bins)
        steepness = np.tan(tilt)[:, None]
        return np.stack(
            [steepness * np.cos(direction), steepness * np.sin(direction)], axis=-1
        ).astype(np.float32)

    def change_at(self, x_px: float, y_px: float) -> Float64:
        """Return the change of the channels for each slope at one place, (B, B, 3), of 255."""
        return np.asarray(self.coefficients @ place_terms(x_px, y_px))


def bin_angles(bins: int) -> tuple[Float64, Float64]:
    """Return tilt and direction in the middle of each bin, in radians."""
    middle = np.arange(bins) + 0.5
    tilt = np.minimum(middle * (np.pi / 2) / (bins - 1), np.pi / 2)
    return tilt, middle * 2 * np.pi / (bins - 1) - np.pi


def place_terms(x_px: ArrayLike, y_px: ArrayLike) -> Float64:
    """Return the terms of a polynomial at some places, (..., 6)."""
    x, y = np.broadcast_arrays(np.asarray(x_px, float), np.asarray(y_px, float))
    return np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=-1)


def read_table(path: Path, order: Order) -> PolynomialTable:
    """Read a ``polycalib.npz``.

    Parameters
    ----------
    path : Path
    order : {"bgr", "rgb"}
        Order of the channels in the file: Taxim's own, or Isaac Lab's.

    Raises
    ------
    InputError
        The file is of another kind, or its arrays have another size.
    """
    arrays = read_npz(path)
    missing = {"bins", *_ARRAYS} - arrays.keys()
    if missing:
        raise InputError(
            f"{path} has no {sorted(missing)[0]}; give the polycalib.npz of Taxim, with bins, "
            "grad_r, grad_g and grad_b"
        )
    if arrays["bins"].size != 1 or arrays["bins"].dtype.kind not in "iu":
        raise InputError(f"bins in {path} is no whole number; give the polycalib.npz of Taxim")
    bins = int(arrays["bins"])
    for name in _ARRAYS:
        if bins < 2 or arrays[name].shape != (bins, bins, TERMS):
            raise InputError(
                f"{name} in {path} is {arrays[name].shape}, not ({bins}, {bins}, {TERMS}) as for "
                f"{bins} bins; give the polycalib.npz of Taxim"
            )
        if arrays[name].dtype.kind != "f" or not np.isfinite(arrays[name]).all():
            raise InputError(f"{name} in {path} holds no finite numbers; calibrate it again")
    channels = _in_order([np.asarray(arrays[name], float) for name in _ARRAYS], order)
    return PolynomialTable(np.stack(channels, axis=2))


def write_table(path: Path, table: PolynomialTable, order: Order) -> None:
    """Write a ``polycalib.npz`` with the channels in this order."""
    channels = _in_order(list(np.moveaxis(table.coefficients, 2, 0)), order)
    arrays = dict(zip(_ARRAYS, channels, strict=True))
    write_npz(path, {"bins": np.int32(table.bins), **arrays})


def _in_order(channels: list[Float64], order: Order) -> list[Float64]:
    return channels[::-1] if order == "bgr" else channels
