"""Layers: the drawable parts of a quantity, as plain arrays for any viewer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32


@dataclass(frozen=True, eq=False)
class Surface:
    """A height map, drawn as shaded relief.

    Attributes
    ----------
    mm : (H, W) float32
        Finite; larger is nearer to the camera.
    mm_per_px : float
    title : str
    """

    mm: Float32
    mm_per_px: float
    title: str = "height"


@dataclass(frozen=True, eq=False)
class ScalarMap:
    """One number per pixel, drawn in colours with a colour bar.

    Attributes
    ----------
    values : (H, W) of any real dtype
        Finite values.
    unit : str
    title : str
    """

    values: NDArray[Any]
    unit: str = ""
    title: str = ""


@dataclass(frozen=True, eq=False)
class VectorMap:
    """One in-plane vector per pixel, drawn as its magnitude with arrows.

    Attributes
    ----------
    values : (H, W, 2) float32
        Finite; +x right, +y down.
    valid : (H, W) bool or None
        Where it is False, the map is drawn paler and without arrows.
    unit : str
        Arrows of ``mm`` are displacements, drawn to a stated scale.
    title : str
    """

    values: Float32
    valid: Bool | None = None
    unit: str = ""
    title: str = ""


@dataclass(frozen=True, eq=False)
class Outline:
    """A region of the image, drawn as its border over the maps.

    Attributes
    ----------
    mask : (H, W) bool
    title : str
        Drawn with the area of the region.
    """

    mask: Bool
    title: str = "contact"


@dataclass(frozen=True, eq=False)
class Points:
    """Points of the image, drawn over the maps, or over the frame if there are no maps.

    Attributes
    ----------
    px : (N, 2) float32
        x and y; points that are not finite are not drawn.
    title : str
    from_px : (N, 2) float32 or None
        Earlier position of each point, from which an arrow is drawn.
    reliable : (N,) bool or None
        Points that are not reliable are drawn hollow.
    """

    px: Float32
    title: str = ""
    from_px: Float32 | None = None
    reliable: Bool | None = None


Layer = Surface | ScalarMap | VectorMap | Outline | Points
