"""Compiled loop of :mod:`tactile_desktop_six_led.stereo_field`; needs numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tactile_core.algorithms.kernels.options import LOOP, ROW
from tactile_core.algorithms.kernels.stored import load_alone

Float32 = NDArray[np.float32]


@njit(**ROW)
def _respond(plane: Any, table: Float32, undeformed: Float32, response: Float32) -> None:
    for x in range(response.size):
        response[x] = table[plane[x]] * undeformed[x] - np.float32(1)


@njit(**ROW)
def _start(y: Any, tilt: Float32, b: Float32) -> None:
    for x in range(b.shape[1]):
        b[0, x] = tilt[0, 0, x] + y * (tilt[0, 1, x] + y * tilt[0, 2, x])
        b[1, x] = tilt[1, 0, x] + y * (tilt[1, 1, x] + y * tilt[1, 2, x])
        b[2, x] = np.float32(1)


@njit(**ROW)
def _add_light(response: Float32, y: Any, rows: Float32, b: Float32) -> None:
    for x in range(response.size):
        b[0, x] += response[x] * (rows[0, 0, x] + y * (rows[0, 1, x] + y * rows[0, 2, x]))
        b[1, x] += response[x] * (rows[1, 0, x] + y * (rows[1, 1, x] + y * rows[1, 2, x]))
        b[2, x] += response[x] * (rows[2, 0, x] + y * rows[2, 1, x])


@njit(**ROW)
def _add_scaled(response: Float32, factor: Any, residual: Float32) -> None:
    for x in range(residual.size):
        residual[x] += response[x] * factor


@njit(**ROW)
def _add_square(residual: Float32, square: Float32) -> None:
    for x in range(square.size):
        square[x] += residual[x] * residual[x]


@njit(**ROW)
def _finish(
    b: Float32, square: Float32, least: Any, limit: Any, gx: Float32, gy: Float32, outlier: Any
) -> None:
    for x in range(gx.size):
        facing = np.float32(1) / max(b[2, x], least)
        gx[x] = b[0, x] * facing
        gy[x] = b[1, x] * facing
        outlier[x] = square[x] > limit


@njit(**LOOP)
def solve(
    planes: Any,
    tables: Float32,
    undeformed: Float32,
    light: tuple[Float32, Float32],
    redundancy: tuple[Float32, float],
    tilt: Float32,
    least_facing: Any,
    slopes: Float32,
    outlier: Any,
) -> None:
    """Compute the slopes of each pixel, and whether its lights contradict each other.

    Parameters
    ----------
    planes : (K, H, W) uint8
        Smoothed exposures.
    tables : (K, 256) float32
        Linear response of each grey level.
    undeformed : (K, H, W) float32
        Inverse linear response of the undeformed gel surface.
    light : (H,) and (K, 3, 3, W) float32
        Positions along y, and the light field M of each light along x as coefficients of the powers
        0, 1 and 2 of y.
    redundancy : (K − 3, K) float32 and float
        Combinations that vanish, and the tolerance of their residual.
    tilt : (2, 3, W) float32
        Apparent tilt of level gel along x, as coefficients of the powers 0, 1 and 2 of y.
    least_facing : float32
        Lower limit of the normal's component towards the camera.
    slopes : (2, H, W) float32
        Output.
    outlier : (H, W) bool
        Output: the lights contradict each other.
    """
    lights, height, width = undeformed.shape
    places, rows = light
    combinations, tolerance = redundancy
    response, b = np.empty((lights, width), np.float32), np.empty((3, width), np.float32)
    residual, square = np.empty(width, np.float32), np.empty(width, np.float32)
    limit = np.float32(tolerance * tolerance)
    for y in range(height):
        _start(places[y], tilt, b)
        for k in range(lights):
            _respond(planes[k, y], tables[k], undeformed[k, y], response[k])
            _add_light(response[k], places[y], rows[k], b)
        square[:] = 0
        for c in range(len(combinations)):
            residual[:] = 0
            for k in range(lights):
                _add_scaled(response[k], combinations[c, k], residual)
            _add_square(residual, square)
        _finish(b, square, least_facing, limit, slopes[0, y], slopes[1, y], outlier[y])


load_alone(solve)
