"""Units of quantities in SI units, which ROS uses (REP 103)."""

from __future__ import annotations

import math
from typing import NamedTuple


class SiUnit(NamedTuple):
    """A unit of ROS.

    Attributes
    ----------
    name : str
    factor : float
        By which a value in the unit of the quantity is multiplied.
    """

    name: str
    factor: float = 1.0


_SI = {
    "mm": SiUnit("m", 1e-3),
    "mm/px": SiUnit("m/px", 1e-3),
    "mm/s": SiUnit("m/s", 1e-3),
    "mm²": SiUnit("m²", 1e-6),
    "mm2": SiUnit("m²", 1e-6),
    "N·mm": SiUnit("N·m", 1e-3),
    "N mm": SiUnit("N·m", 1e-3),
    "N*mm": SiUnit("N·m", 1e-3),
    "Nmm": SiUnit("N·m", 1e-3),
    "MPa": SiUnit("Pa", 1e6),
    "kPa": SiUnit("Pa", 1e3),
    "ms": SiUnit("s", 1e-3),
    "deg": SiUnit("rad", math.pi / 180),
    "°": SiUnit("rad", math.pi / 180),
    "deg/s": SiUnit("rad/s", math.pi / 180),
}


def si_unit(unit: str) -> SiUnit:
    """Return the SI unit of a quantity's unit; a unit that is not in the list stays as it is."""
    return _SI.get(unit, SiUnit(unit))
