"""Several quantities as named arrays of one self-describing file."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npz
from tactile_core.quantities import Quantity
from tactile_core.quantities.fields import fields_of
from tactile_core.quantities.quantity import Guard, unguarded

DESCRIPTION = "quantities"  # Name of the array that describes the others: JSON as UTF-8 bytes

Arrays = Mapping[str, NDArray[Any]]  # Arrays by name


def arrays_of(
    quantities: Iterable[Quantity], *, mm_per_px: float, guard: Guard = unguarded
) -> dict[str, NDArray[Any]]:
    """Return the arrays of several quantities, finite everywhere, and their description.

    Arrays of two quantities that have the same name are stored once if they are equal. If they
    differ, the second is named after its quantity's type: ``Type.name``. ``mm_per_px`` is always
    included, and ``valid`` if a quantity distinguishes measured from filled-in values.

    Parameters
    ----------
    quantities : iterable of Quantity
    mm_per_px : float
        Scale of the image.
    guard : callable, optional
        Returns a context in which a quantity's own code runs, to attribute its errors.
    """
    merged: dict[str, NDArray[Any]] = {}
    described: dict[str, Any] = {}
    validity: NDArray[Any] | None = None
    for quantity in quantities:
        with guard(quantity):
            clean = quantity.finite()
            own = {str(name): _finite(np.asarray(a)) for name, a in clean.arrays().items()}
            fields = fields_of(type(quantity))
        stored = {name: _place(merged, name, array, quantity) for name, array in own.items()}
        merged.update((stored[name], array) for name, array in own.items())
        kind = type(quantity)
        title = kind.__name__ if kind.__name__ not in described else _full_name(kind)
        described[title] = {
            "arrays": stored,
            "none": [f.spec.saved_as for f in fields if getattr(quantity, f.name) is None],
            "fields": {field.name: field.described() for field in fields},
        }
        for field in fields:
            if field.spec.validity and validity is None:
                validity = own.get(field.spec.saved_as)
    if validity is not None:
        merged.setdefault("valid", validity)
    merged.setdefault("mm_per_px", np.asarray(mm_per_px))
    text = json.dumps(described).encode()
    merged[DESCRIPTION] = np.frombuffer(text, np.uint8)
    return merged


def quantities_in(arrays: Arrays, *kinds: type[Quantity]) -> dict[type[Quantity], Quantity]:
    """Restore quantities of the given types; types that the arrays lack are left out.

    Raises
    ------
    InputError
        The description is missing or invalid, or a quantity's array is missing or has the wrong
        shape.
    """
    try:
        described: Mapping[str, Any] = json.loads(np.asarray(arrays[DESCRIPTION]).tobytes())
        found: dict[type[Quantity], Quantity] = {}
        for kind in kinds:
            entry = described.get(_full_name(kind), described.get(kind.__name__))
            if entry is not None:
                missing = set(entry["none"])
                own = {
                    name: arrays[place]
                    for name, place in entry["arrays"].items()
                    if name not in missing
                }
                found[kind] = kind.from_arrays(own)
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        raise InputError(
            f"these are not the arrays of a reading ({error}); run the measurement again"
        ) from error
    return found


def read_quantities(path: Path, *kinds: type[Quantity]) -> dict[type[Quantity], Quantity]:
    """Read quantities of the given types from an ``.npz`` that a run wrote.

    Raises
    ------
    InputError
        The file is missing, corrupt or not written by a run.
    """
    arrays = read_npz(path)
    try:
        return quantities_in(arrays, *kinds)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _place(merged: Arrays, name: str, array: NDArray[Any], quantity: Quantity) -> str:
    stored = merged.get(name)
    if stored is None or (stored.dtype == array.dtype and np.array_equal(stored, array)):
        return name
    return f"{type(quantity).__name__}.{name}"


def _full_name(kind: type[Quantity]) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"


def _finite(array: NDArray[Any]) -> NDArray[Any]:
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return array
    return np.where(np.isfinite(array), array, array.dtype.type(0))
