"""Finds forces and torques among the fields of any quantity."""

from __future__ import annotations

import re
from typing import NamedTuple

from tactile_core.quantities import Quantity
from tactile_core.quantities.fields import Field, fields_of
from tactile_rosbag.si_units import si_unit

# Names of the components of a wrench, with or without their unit.
_COMPONENT = re.compile(r"([ft][xyz])(?:_n|_nmm|_nm)?")


class RosWrench(NamedTuple):
    """A force and a torque on the sensor, in its right-handed frame (z away from the camera).

    Attributes
    ----------
    force_n, torque_nm : (x, y, z)
    """

    force_n: tuple[float, float, float]
    torque_nm: tuple[float, float, float]


def has_wrench(kind: type[Quantity]) -> bool:
    """Whether quantities of this type can have a wrench."""
    return "fz" in _components(kind)


def wrench_of(quantity: Quantity) -> RosWrench | None:
    """Return the wrench in a quantity with fields such as ``fz`` in N; None if it has none.

    The fields have the convention of tactile sensing, where a compression is positive ``fz``. In
    the right-handed frame of the sensor it pushes towards the camera, along −z.
    """
    found = {
        component: float(value) * si_unit(field.spec.unit).factor
        for component, field in _components(type(quantity)).items()
        if (value := getattr(quantity, field.name)) is not None
    }
    if "fz" not in found:
        return None
    fx, fy, fz, tx, ty, tz = (found.get(name, 0.0) for name in ("fx", "fy", "fz", "tx", "ty", "tz"))
    return RosWrench((fx, fy, 0.0 - fz), (tx, ty, tz))


def _components(kind: type[Quantity]) -> dict[str, Field]:
    """Return the fields of a type that are components of a wrench, by component."""
    found: dict[str, Field] = {}
    for field in fields_of(kind):
        name = _COMPONENT.fullmatch(field.name)
        is_force = field.form is float and si_unit(field.spec.unit).name in ("N", "N·m")
        if name is not None and is_force:
            found[name[1]] = field
    return found
