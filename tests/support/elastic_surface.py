"""Surfaces of an elastic gel under rigid objects, as the theory of contact gives them."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.normal_contact import solve_normal

Map = NDArray[np.float64]
Object = Callable[[Map, Map], Map]
"""Depth in mm to which a rigid object reaches at (x, y) in mm; negative above the gel."""

AWAY_MM = -100.0


def ball(x_mm: float, y_mm: float, depth_mm: float, radius_mm: float) -> Object:
    """A ball whose lowest point is above a place."""
    return lambda x, y: depth_mm - ((x - x_mm) ** 2 + (y - y_mm) ** 2) / (2 * radius_mm)


def plate(x_mm: float, y_mm: float, depth_mm: float, half_mm: float) -> Object:
    """A square plate parallel to the gel."""
    return lambda x, y: np.where(
        np.maximum(abs(x - x_mm), abs(y - y_mm)) <= half_mm, depth_mm, AWAY_MM
    )


def indent(
    *objects: Object, shape: tuple[int, int], mm_per_px: float, thickness_mm: float = 2.0
) -> Map:
    """Return the (H, W) height of a bonded layer that objects indent; x and y begin at (0, 0)."""
    spacing_mm, margin = 2 * mm_per_px, int(2 * thickness_mm / (2 * mm_per_px))
    rows, columns = (side // 2 for side in shape)
    grid = SurfaceGrid.covering(
        (columns + 2 * margin) * spacing_mm, (rows + 2 * margin) * spacing_mm, spacing_mm
    )
    # the centre of two by two pixels
    x, y = ((np.arange(count) - margin + 0.25) * spacing_mm for count in (grid.nx, grid.ny))
    reach = np.max([one(*np.meshgrid(x, y)) for one in objects], axis=0)
    layer = ElasticLayer(grid, Elastomer(thickness_mm, 0.145, 0.48), np.float64)
    pressure = solve_normal(layer.indentation, reach, np.zeros(grid.shape)).pressure
    view = layer.indentation(pressure)[margin : margin + rows, margin : margin + columns]
    wide = cv2.resize(view, shape[::-1], interpolation=cv2.INTER_CUBIC)
    return np.asarray(wide, float)
