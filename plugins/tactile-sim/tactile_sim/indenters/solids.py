"""Shapes of simple solids."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.errors import InputError

FAR_MM = 1e3  # Gap outside the object, mm: out of reach of the gel


class Indenter(ABC):
    """Object in its own frame, undeformed: x right, y down, z away from the gel.

    Immutable and picklable; the stage holds its pose.
    """

    @abstractmethod
    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """Height of the lower side above the lowest point, mm, at any positions.

        Non-negative, 0 at the lowest point, and :data:`FAR_MM` outside the object.
        """

    @property
    def rolling_radius_mm(self) -> float | None:
        """Radius of a surface of revolution that can roll; None if the object cannot roll."""
        return None

    @property
    def rolls_along_x(self) -> bool:
        """Whether the object can roll along its own x axis in addition to y."""
        return True

    @property
    def detail_mm(self) -> float | None:
        """Size of the finest feature, which the nodes should resolve; None if smooth."""
        return None


def round_gap(distance_mm: Array, radius_mm: float) -> Array:
    """Height of a circle of this radius above its lowest point; FAR_MM outside the circle."""
    near = distance_mm < 0.995 * radius_mm  # [radii] beyond, the wall is nearly vertical
    if near.all():
        return _rise(distance_mm, radius_mm)
    # most nodes of a gel surface are not below the object
    gap = np.full_like(distance_mm, FAR_MM)
    gap[near] = _rise(distance_mm[near], radius_mm)
    return gap


def _rise(distance_mm: Array, radius_mm: float) -> Array:
    square = np.maximum(distance_mm / radius_mm, 0) ** 2
    return np.asarray(radius_mm * square / (1 + np.sqrt(1 - square)))  # no cancellation near 0


def rim_gap(outside_mm: Array, edge_mm: float) -> Array:
    """Height of a rounded edge at distances outside the flat part; FAR_MM beyond the edge."""
    if edge_mm == 0:
        return np.asarray(np.where(outside_mm > 0, FAR_MM, 0.0))
    return np.asarray(np.where(outside_mm > 0, round_gap(outside_mm, edge_mm), 0.0))


def positive(what: str, value: float) -> float:
    """Return the value, or raise an InputError that names it if it is not a positive number."""
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{what} should be a number above 0, not {value:g}")
    return float(value)


@dataclass(frozen=True)
class Sphere(Indenter):
    """A sphere.

    Parameters
    ----------
    diameter_mm : float
    """

    diameter_mm: float

    def __post_init__(self) -> None:
        positive("a sphere's diameter_mm", self.diameter_mm)

    @property
    def rolling_radius_mm(self) -> float | None:
        """Half the diameter."""
        return self.diameter_mm / 2

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        return round_gap(_distance(x_mm, y_mm), self.diameter_mm / 2)


@dataclass(frozen=True)
class Cylinder(Indenter):
    """A cylinder on its side, with rounded ends; its axis is along the object's x.

    Parameters
    ----------
    diameter_mm, length_mm : float
    edge_mm : float
        Edge radius of the ends, at most half the diameter.
    """

    diameter_mm: float
    length_mm: float = 30.0
    edge_mm: float = 0.3

    def __post_init__(self) -> None:
        positive("a cylinder's diameter_mm", self.diameter_mm)
        positive("a cylinder's length_mm", self.length_mm)
        _check_edge(self.edge_mm, min(self.diameter_mm, self.length_mm) / 2, "cylinder")

    @property
    def rolling_radius_mm(self) -> float | None:
        """Half the diameter."""
        return self.diameter_mm / 2

    @property
    def rolls_along_x(self) -> bool:
        """False: x is the cylinder's axis."""
        return False

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        outside = np.abs(x_mm) - (self.length_mm / 2 - self.edge_mm)
        return round_gap(np.abs(y_mm), self.diameter_mm / 2) + rim_gap(outside, self.edge_mm)


@dataclass(frozen=True)
class Flat(Indenter):
    """A flat-ended punch, round or rectangular, with a rounded edge.

    Parameters
    ----------
    diameter_mm : float, optional
        Diameter of a round punch.
    size_mm : (width, height), optional
        Size of a rectangular punch along x and y.
    edge_mm : float
        Edge radius; the size includes the rounding.
    """

    diameter_mm: float | None = None
    size_mm: tuple[float, float] | None = None
    edge_mm: float = 0.1

    def __post_init__(self) -> None:
        if (self.diameter_mm is None) == (self.size_mm is None):
            raise InputError("a flat punch needs either diameter_mm or size_mm, and not both")
        sides = self.size_mm if self.size_mm is not None else (self.diameter_mm,)
        for side in sides:
            positive("a flat punch's size", side if side is not None else 0.0)
        _check_edge(self.edge_mm, min(side or 0.0 for side in sides) / 2, "flat punch")

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        if self.size_mm is None:
            assert self.diameter_mm is not None
            outside = _distance(x_mm, y_mm) - (self.diameter_mm / 2 - self.edge_mm)
        else:
            dx, dy = (
                np.maximum(np.abs(along) - (side / 2 - self.edge_mm), 0)
                for along, side in zip((x_mm, y_mm), self.size_mm, strict=True)
            )
            outside = np.hypot(dx, dy)
        return rim_gap(outside, self.edge_mm)


@dataclass(frozen=True)
class Cone(Indenter):
    """A cone with a rounded tip.

    Parameters
    ----------
    half_angle_deg : float
        Angle between axis and side; 90° would be flat.
    diameter_mm : float
        Diameter of the base.
    tip_mm : float
        Radius of the tip.
    """

    half_angle_deg: float = 60.0
    diameter_mm: float = 12.0
    tip_mm: float = 0.1

    def __post_init__(self) -> None:
        if not 5 <= self.half_angle_deg < 90:
            raise InputError(
                f"a cone's half_angle_deg should be from 5 to below 90, not {self.half_angle_deg:g}"
            )
        positive("a cone's diameter_mm", self.diameter_mm)
        _check_edge(self.tip_mm, self.diameter_mm / 2, "cone")

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        r, half = _distance(x_mm, y_mm), np.radians(self.half_angle_deg)
        slope = 1 / np.tan(half)
        meets = self.tip_mm * np.cos(half)  # radius at which the tip is tangent to the side
        tip = self.tip_mm - np.sqrt(np.maximum(self.tip_mm**2 - np.minimum(r, meets) ** 2, 0))
        side = tip + slope * np.maximum(r - meets, 0)
        return np.asarray(np.where(r < self.diameter_mm / 2, side, FAR_MM))


def _distance(x_mm: Array, y_mm: Array) -> Array:
    """Distance from the axis. np.hypot, safe from overflow, is slower."""
    return np.asarray(np.sqrt(x_mm * x_mm + y_mm * y_mm))


def _check_edge(edge_mm: float, most_mm: float, what: str) -> None:
    if not 0 <= edge_mm <= most_mm:
        raise InputError(
            f"the rounding of a {what} should be from 0 to {most_mm:g} mm, half its size, "
            f"not {edge_mm:g}"
        )
