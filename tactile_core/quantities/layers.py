"""What of a quantity can be drawn in the image, as plain arrays for whatever draws it."""

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
        Finite; larger is nearer to the viewer.
    mm_per_px : float
    title : str
    """

    mm: Float32
    mm_per_px: float
    title: str = "height"


@dataclass(frozen=True, eq=False)
class ScalarMap:
    """One number a pixel, drawn in colours beside a colour bar.

    Attributes
    ----------
    values : (H, W) of any real dtype
        Finite.
    unit : str
    title : str
    """

    values: NDArray[Any]
    unit: str = ""
    title: str = ""


@dataclass(frozen=True, eq=False)
class VectorMap:
    """One vector along the surface a pixel, drawn as its magnitude with arrows.

    Attributes
    ----------
    values : (H, W, 2) float32
        Finite; +x right, +y down.
    valid : (H, W) bool or None
        The map is paler where it is False, and bears no arrows.
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
        Its area is given beside it.
    """

    mask: Bool
    title: str = "contact"


@dataclass(frozen=True, eq=False)
class Points:
    """Points of the image, drawn over the maps, or over the frame where there is none.

    Attributes
    ----------
    px : (N, 2) float32
        x and y; those that are not finite are left out.
    title : str
    from_px : (N, 2) float32 or None
        Where each was before: an arrow points from there.
    sure : (N,) bool or None
        The others are drawn hollow.
    """

    px: Float32
    title: str = ""
    from_px: Float32 | None = None
    sure: Bool | None = None


Layer = Surface | ScalarMap | VectorMap | Outline | Points
