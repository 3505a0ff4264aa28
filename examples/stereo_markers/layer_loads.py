"""The loads on the gel that move its markers as measured: a non-negative pressure with friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid

FINE_MM, STEP_MM, REACH_MM, EXTENT_MM = 0.25, 1.0, 9.0, 60.0
POISSON_RATIO = 0.48
ROUNDS = 100


class Layer(NamedTuple):
    """What is assumed of the gel, whose modulus cancels.

    Attributes
    ----------
    thickness_mm : float
    damping : float
        Penalty on the loads, as a share of the largest singular value.
    """

    thickness_mm: float
    damping: float


def load_moments(markers_mm: Float64, moved_mm: Float64, layer: Layer) -> Float64:
    """Return the moments of the loads up to second order.

    Loads are forces at the nodes of a grid. They minimise the squared misfit of the markers plus
    damping, with non-negative pressure and shear no larger than it, by FISTA.

    Parameters
    ----------
    markers_mm : (M, 2)
    moved_mm : (N, M, 3)
        z away from the camera, so that a pressed marker has a negative one.
    layer : Layer

    Returns
    -------
    (N, 3, 6) float64
        Of shear along x and y and of pressure: the sum, and that times x, y, x², xy and y².
    """
    response, nodes = _response(markers_mm, layer.thickness_mm)
    loads = _loads(response, moved_mm.reshape(len(moved_mm), -1), layer.damping)
    x, y = nodes.T
    powers = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], 1)
    return np.einsum("tnc,nk->tck", loads, powers)


def _response(markers_mm: Float64, thickness_mm: float) -> tuple[Float64, Float64]:
    """(3 M, 3 N) displacement of each marker by a unit load on each node, and the (N, 2) nodes."""
    count = int(EXTENT_MM / FINE_MM)
    grid = SurfaceGrid(count, count, FINE_MM)
    elastic = ElasticLayer(grid, Elastomer(thickness_mm, 1.0, POISSON_RATIO), np.float64)
    x, y = grid.nodes_mm
    one = np.exp(-(x**2 + y**2) / 2 / (STEP_MM / 2) ** 2)
    one /= one.sum() * FINE_MM**2
    none = np.zeros_like(one)
    down, spread = -np.asarray(elastic.indentation(one)), np.asarray(elastic.spread(one))
    along_x = np.asarray(elastic.shift(np.stack([one, none])))
    along_y = np.asarray(elastic.shift(np.stack([none, one])))
    line = np.arange(-REACH_MM, REACH_MM + STEP_MM / 2, STEP_MM)
    nodes = np.stack(np.meshgrid(line, line), -1).reshape(-1, 2)
    away = markers_mm[:, None] - nodes

    def at(field: Float64, offset: Float64) -> Float64:
        rows, columns = (offset[..., 1] - y[0, 0]) / FINE_MM, (offset[..., 0] - x[0, 0]) / FINE_MM
        return np.asarray(map_coordinates(field, [rows, columns], order=1, mode="nearest"))

    found = np.zeros((len(markers_mm), 3, len(nodes), 3))
    for axis in (0, 1):
        found[:, axis, :, 0] = at(along_x[axis], away)
        found[:, axis, :, 1] = at(along_y[axis], away)
        found[:, axis, :, 2] = at(spread[axis], away)
        found[:, 2, :, axis] = -at(spread[axis], -away)  # by reciprocity
    found[:, 2, :, 2] = at(down, away)
    return found.reshape(3 * len(markers_mm), 3 * len(nodes)), nodes


def _loads(response: Float64, moved: Float64, damping: float) -> Float64:
    stiffest = float(np.linalg.norm(response, 2)) ** 2
    normal, right = response.T @ response, moved @ response
    step = 1 / (stiffest * (1 + damping))
    found = ahead = np.zeros((len(moved), response.shape[1]))
    pace = 1.0
    for _ in range(ROUNDS):
        new = ahead - step * (ahead @ normal - right + damping * stiffest * ahead)
        new = _within_friction(new.reshape(len(moved), -1, 3)).reshape(found.shape)
        faster = (1 + np.sqrt(1 + 4 * pace**2)) / 2
        ahead = new + (pace - 1) / faster * (new - found)
        found, pace = new, faster
    return found.reshape(len(moved), -1, 3)


def _within_friction(loads: Float64) -> Float64:
    """Project onto the cone where shear is at most the pressure."""
    shear, pressure = np.hypot(loads[..., 0], loads[..., 1]), loads[..., 2]
    inside = shear <= pressure
    border = np.maximum((shear + pressure) / 2, 0)
    scale = np.where(inside, 1, border / np.maximum(shear, 1e-12))
    kept = np.where(inside, pressure, border)
    return np.stack([loads[..., 0] * scale, loads[..., 1] * scale, kept], -1)
