"""The numbers and words of a reading, with titles and units, for any quantity."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactile_core.formats.text import plain
from tactile_core.interfaces.sink import Reading
from tactile_core.plugins.blame import blame_of
from tactile_core.quantities import Quantity, Wrench
from tactile_core.quantities.fields import fields_of

# Units at the end of the names in a summary.
_UNITS = {
    "mm2": "mm²",
    "nmm": "N·mm",
    "mm": "mm",
    "n": "N",
    "deg": "°",
    "bits": "bit",
    "bit": "bit",
    "ms": "ms",
    "s": "s",
    "hz": "Hz",
    "px": "px",
}

_SHOWN_UNITS = {"deg": "°", "mm/mm": ""}

# Keys of the best-known numbers; those of a wrench that are measured are plotted too.
_FEATURED = ("max_height_mm", "contact_area_mm2", "slip.degree", "load")

_FEW = 6  # Longest row of numbers that is a handful of numbers, such as a wrench, and not a curve


@dataclass(frozen=True)
class Entry:
    """One number, word or row of numbers of a quantity.

    Attributes
    ----------
    key : str
        Identifies it among the entries of all readings of a sensor.
    title : str
        In words.
    unit : str
    value : float, bool, str, list of float or None
        JSON-ready.
    featured : bool
        Whether it is plotted without being asked for: the best-known numbers, and all of a
        plugin's own quantity.
    """

    key: str
    title: str
    unit: str
    value: Any
    featured: bool = False

    @property
    def is_number(self) -> bool:
        """Whether it can be plotted over time."""
        return isinstance(self.value, int | float) and not isinstance(self.value, bool)


def entries_of(reading: Reading) -> tuple[list[Entry], list[str]]:
    """Return the entries of all quantities of a reading, and what is wrong with some of them.

    A quantity whose own code fails is left out with a sentence that names its plugin.
    """
    found: dict[str, Entry] = {}
    faults = []
    for quantity in reading.quantities.values():
        try:
            with blame_of(quantity):
                entries = list(_entries(quantity))
        except Exception as error:  # a stranger's code
            faults.append(str(error))
        else:
            found.update((entry.key, entry) for entry in entries)
    return list(found.values()), faults


def _entries(quantity: Quantity) -> Iterator[Entry]:
    kind = type(quantity)
    own = not kind.__module__.startswith("tactile_core.")
    units: dict[str, str] = {}
    for field in fields_of(kind):
        units[field.name] = units[field.spec.saved_as] = field.spec.unit
    plotted = {*_measured_loads(quantity)} if isinstance(quantity, Wrench) else set[str]()
    for key, value in _leaves(plain(quantity.summary())):
        name = _name_deviation(key, kind)
        unit = units.get(name, units.get(name.rpartition(".")[2]))
        if unit is None:
            unit = _unit(name) or ("" if isinstance(value, str) else _own_unit(quantity))
        featured = own or key in _FEATURED or key in plotted
        yield Entry(key, _title(name), _format_unit(unit), value, featured)
    if kind.summary is not Quantity.summary:
        return
    for field in fields_of(kind):
        value = getattr(quantity, field.name)
        if not field.is_array or value is None or value.ndim != 1 or value.dtype.kind not in "fiu":
            continue
        key, unit = field.spec.saved_as, _format_unit(field.spec.unit)
        numbers = plain(np.asarray(value[:512], np.float64).tolist())  # [count] longest curve
        if len(value) <= _FEW:
            for index, number in enumerate(numbers):
                yield Entry(f"{key}.{index + 1}", f"{_title(key)} {index + 1}", unit, number, own)
        else:
            yield Entry(key, _title(key), unit, numbers, own)


def _measured_loads(wrench: Wrench) -> Iterator[str]:
    """Yield the keys of the components that are measured, and of their standard deviations."""
    for place, name in enumerate(("fx_n", "fy_n", "fz_n", "tz_nmm")):
        if wrench.measured[place]:
            yield from (f"wrench.{name}", f"wrench.std.{place + 1}")


def _name_deviation(key: str, kind: type[Quantity]) -> str:
    """Return the name of the field that a place in a row of standard deviations stands for."""
    group, _, place = key.rpartition(".")
    group, _, row = group.rpartition(".")
    if row != "std" or not place.isdigit():
        return key
    deviations = [field.name for field in fields_of(kind) if field.spec.std_of]
    return f"{group}.{deviations[int(place) - 1]}" if int(place) <= len(deviations) else key


def _own_unit(quantity: Quantity) -> str:
    """Return the unit of a quantity whose unit is not that of its class, such as a network's."""
    unit = getattr(quantity, "unit", "")
    return unit if isinstance(unit, str) else ""


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for name, item in value.items():
            yield from _leaves(item, f"{path}.{name}" if path else str(name))
    elif isinstance(value, list) and path and len(value) <= _FEW:
        for index, item in enumerate(value):
            yield from _leaves(item, f"{path}.{index + 1}")
    elif not isinstance(value, list):
        yield path, value


def _format_unit(unit: str) -> str:
    return _SHOWN_UNITS.get(unit, unit)


def _unit(key: str) -> str:
    return _UNITS.get(key.rpartition("_")[2], "") if "_" in key else ""


def _title(key: str) -> str:
    name = key.rpartition("_")[0] if _unit(key) else key
    name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return re.sub(r"[._]+", " ", name).strip().lower()
