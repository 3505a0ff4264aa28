"""What every measured thing has in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import MISSING, dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import enlarged
from tactile_core.errors import InputError
from tactile_core.quantities.fields import Field, fields_of
from tactile_core.quantities.layers import Layer, Outline, Points, ScalarMap, VectorMap

Arrays = Mapping[str, NDArray[Any]]
Guard = Callable[["Quantity"], AbstractContextManager[None]]
"""Gives a context for the work on one quantity, in which its own code may fail."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """Base of everything a :class:`~tactile_core.interfaces.estimator.Estimator` may take or give.

    A third party's quantity subclasses this, says what each field holds
    (:class:`~tactile_core.quantities.FieldSpec`), and is checked, saved, read back, drawn and
    streamed like ours.
    """

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                view = value.view()
                view.flags.writeable = False
                object.__setattr__(self, name, view)

    def full(self, name: str) -> NDArray[Any]:
        """Return a field of the size of the image, enlarged where it lives on a coarser grid.

        Between the middles of the cells values are linear.

        Parameters
        ----------
        name : str
            A field over ``y`` and ``x``; another one of the quantity has the size of the image.
        """
        sizes = [getattr(self, f.name).shape[:2] for f in _images(type(self)) if not f.spec.coarse]
        values: NDArray[Any] = getattr(self, name)
        return values if not sizes else enlarged(values, sizes[0])

    def arrays(self) -> Arrays:
        """Named arrays from which :meth:`from_arrays` makes it again.

        A field that is None is left out, unless files must hold something. Add what other programs
        want to find.
        """
        parts: dict[str, list[NDArray[Any]]] = {}
        for field in fields_of(type(self)):
            value = getattr(self, field.name)
            if value is None:
                value = field.spec.if_none
            if value is not None:
                array = self.full(field.name) if field.spec.coarse else _array(self, field, value)
                parts.setdefault(field.spec.saved_as, []).append(array)
        return {name: a[0] if len(a) == 1 else np.stack(a, axis=-1) for name, a in parts.items()}

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> Self:
        """Make the quantity again from what :meth:`arrays` gave.

        Raises
        ------
        InputError
            An array is missing.
        """
        fields = fields_of(cls)
        names = [field.spec.saved_as for field in fields]
        values: dict[str, Any] = {}
        for number, field in enumerate(fields):
            name = field.spec.saved_as
            if name in arrays:
                stacked = names.count(name) > 1
                array = arrays[name][..., names[:number].count(name)] if stacked else arrays[name]
                values[field.name] = _value(field, array)
            elif field.optional:
                values[field.name] = None
            elif field.default is MISSING:
                raise InputError(f"there is no array {name!r}, which {cls.__name__} needs")
        return cls(**values)

    def finite(self) -> Self:
        """Return it with 0 where a value is no number, which its validity then says.

        What the steps of a pipeline give is finite already.
        """
        fields = [f for f in fields_of(type(self)) if f.is_array]
        arrays = {f.name: a for f in fields if (a := getattr(self, f.name)) is not None}
        bad = {
            name: ~np.isfinite(array)
            for name, array in arrays.items()
            if array.dtype.kind == "f" and not np.isfinite(array).all()
        }
        if not bad:
            return self
        changed = {n: np.where(bad[n], arrays[n].dtype.type(0), arrays[n]) for n in bad}
        for field in fields:
            if field.spec.validity and field.name in arrays:
                valid = arrays[field.name]
                for holes in bad.values():
                    if holes.shape[:2] == valid.shape:
                        valid = valid & ~holes.reshape(*valid.shape, -1).any(axis=2)
                changed[field.name] = valid
        return replace(self, **changed)

    def layers(self) -> tuple[Layer, ...]:
        """What of it can be drawn in the image; by default what the fields say."""
        found: list[Layer] = []
        for field in fields_of(type(self)):
            value, spec = getattr(self, field.name), field.spec
            if not field.is_array or value is None or spec.validity or spec.std_of:
                continue
            title = f"{type(self).__name__} {field.name}"
            if spec.axes == ("y", "x") and value.dtype == np.bool_:
                found.append(Outline(value, title))
            elif spec.axes == ("y", "x"):
                found.append(ScalarMap(self.full(field.name), spec.unit, title))
            elif spec.axes == ("y", "x", "xy"):
                found.append(VectorMap(self.full(field.name), None, spec.unit, title))
            elif spec.unit == "px" and spec.axes is not None and spec.axes[1:] == ("xy",):
                found.append(Points(value, title))
        return tuple(found)

    def summary(self) -> Mapping[str, Any]:
        """A few JSON-ready values for a line of ``tactile run --json``; by default the scalars."""
        said: dict[str, list[Any]] = {}
        for field in fields_of(type(self)):
            if field.form in (bool, int, float, str) and not field.spec.shared:
                said.setdefault(field.spec.saved_as, []).append(getattr(self, field.name))
        return {name: values[0] if len(values) == 1 else values for name, values in said.items()}

    def warnings(self) -> tuple[str, ...]:
        """Plain sentences that a reading passes on to the user."""
        return ()


def unguarded(_: Quantity) -> AbstractContextManager[None]:
    """Let what a quantity's code raises pass."""
    return nullcontext()


def _images(kind: type[Quantity]) -> list[Field]:
    return [f for f in fields_of(kind) if f.is_array and (f.spec.axes or ())[:2] == ("y", "x")]


def _array(quantity: Quantity, field: Field, value: Any) -> NDArray[Any]:
    if field.form is object:
        raise TypeError(
            f"{type(quantity).__name__}.{field.name} is a {type(value).__name__}, which no array "
            f"can hold; annotate it with an array, a number or text, or write arrays() and "
            f"from_arrays()"
        )
    return np.asarray(value, str) if field.form is tuple and not value else np.asarray(value)


def _value(field: Field, array: NDArray[Any]) -> Any:
    if field.is_array:
        return array
    if field.form is tuple:
        return tuple(array.tolist())
    value = array.item()
    return field.form(value) if field.form in (bool, int, float, str) else value
