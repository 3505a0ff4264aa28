"""Quantities: what is measured, computed when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import MISSING, dataclass, fields, replace
from functools import partial
from typing import Any, NamedTuple, Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import enlarge_cells, interpolate_cells
from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError
from tactile_core.quantities.fields import (
    Field,
    Layer,
    Outline,
    Points,
    ScalarMap,
    VectorMap,
    fields_of,
)

ON_DEMAND = "_on_demand"  # Attribute of a quantity that holds its fields that were given on demand

T = TypeVar("T")


def none() -> None:
    """Return None; the default of a field that may be computed on demand."""


class Grid(NamedTuple):
    """An array over the image on the grid that holds all of it.

    Attributes
    ----------
    cells : (h, w)
        Cell (i, j) is centred at row ``(i + 0.5) · step_px − 0.5``, and its column likewise. The
        last cells may reach beyond the image.
    step_px : int
        Side of a cell; 1 for the pixels of the image.
    shape : (H, W)
        Of the image.
    averaged : bool
        Whether the cells hold means over smaller cells, and not values at their centres.
    """

    cells: NDArray[Any]
    step_px: int
    shape: tuple[int, int]
    averaged: bool = False

    def of_image(self) -> Grid:
        """Return a grid that ends where the image does: itself, or else the image's pixels."""
        if tuple(side * self.step_px for side in self.cells.shape[:2]) == self.shape:
            return self
        return Grid(interpolate_cells(self.cells, self.step_px, self.shape), 1, self.shape)


@dataclass(frozen=True, eq=False)
class OnDemand:
    """Stands for the value of a field until it is read; then ``make`` computes it, once.

    Attributes
    ----------
    make : callable or None
        None for a field that was computed before its quantity was pickled.
    grid : Grid or None
        The same array on a coarser grid.
    """

    make: Callable[[], Any] | None
    grid: Grid | None = None


def on_demand(make: Callable[[], T], grid: Grid | None = None) -> T:
    """Return a value for a quantity's field that is computed when it is read.

    Parameters
    ----------
    make : callable
        Returns the value. Several threads may call it.
    grid : Grid, optional
        The same array on a coarser grid, for steps that need no more.
    """
    # as with dataclasses.field: typed as what a reader of the field gets
    return cast("T", OnDemand(make, grid))


def on_grid(cells: Float32, step_px: int, shape: tuple[int, int]) -> Float32:
    """Return a value for a quantity's field that is interpolated to the image when it is read.

    Parameters
    ----------
    cells : (h, w) float32
        See :class:`Grid`.
    step_px : int
    shape : (H, W)
        Of the image.
    """
    if step_px == 1:
        return cells
    grid = Grid(cells, step_px, shape)
    return on_demand(lambda: interpolate_cells(cells, step_px, shape), grid)


def waiting(quantity: Any) -> dict[str, OnDemand]:
    """Return the fields that were given on demand, by name; also those that have been read."""
    found: dict[str, OnDemand] = quantity.__dict__.get(ON_DEMAND, {})
    return found


def grid_of(quantity: Any, name: str) -> Grid:
    """Return a quantity's field over ``y`` and ``x`` on the coarsest grid that holds all of it."""
    given = waiting(quantity).get(name)
    if given is not None and given.grid is not None:
        return given.grid
    pixels = getattr(quantity, name)
    return Grid(pixels, 1, pixels.shape[:2])


def replace_values(quantity: T, **values: Any) -> T:
    """Return a copy with other values, as :func:`dataclasses.replace` does.

    Fields that are computed on demand stay so.
    """
    kept: dict[str, Any] = {
        name: OnDemand(partial(getattr, quantity, name), given.grid)
        for name, given in waiting(quantity).items()
    }
    names = (field.name for field in fields(cast("Any", quantity)))
    kept |= {name: getattr(quantity, name) for name in names if name not in kept}
    return type(quantity)(**(kept | values))


Arrays = Mapping[str, NDArray[Any]]
# Returns a context manager that handles errors of a quantity's own code.
Guard = Callable[["Quantity"], AbstractContextManager[None]]


_UNREAD = object()  # Stands for a value that is computed on demand, and nobody has read

# Types of values that are neither arrays nor computed on demand.
_PLAIN = {float, int, bool, str, tuple, type(None)}


@dataclass(frozen=True, eq=False)
class Quantity:
    """Base of everything that an :class:`~tactile_core.interfaces.estimator.Estimator` processes.

    A plugin's own quantity is a subclass whose fields are described by
    :class:`~tactile_core.quantities.FieldSpec`. It is then checked, saved, loaded, drawn and
    streamed like those of the core. Arrays become read-only views.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "__repr__" not in vars(cls):
            # before the class is made a dataclass, which would print whole arrays
            cls.__repr__ = Quantity.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        shown = []
        for name in self.__dataclass_fields__:
            value = vars(self).get(name, _UNREAD)
            if isinstance(value, np.ndarray):
                text = f"<{'×'.join(map(str, value.shape))} {value.dtype}>"
            else:
                text = "<computed when read>" if value is _UNREAD else repr(value)
            shown.append(f"{name}={text if len(text) <= 60 else text[:59] + '…'}")
        return f"{type(self).__name__}({', '.join(shown)})"

    def __post_init__(self) -> None:
        values = self.__dict__
        for name, value in [item for item in values.items() if type(item[1]) not in _PLAIN]:
            if isinstance(value, np.ndarray):
                values[name] = _read_only(value)
            elif isinstance(value, OnDemand):
                if hasattr(type(self), name):
                    raise TypeError(f"{name} has a default, so it cannot be computed on demand")
                # reading the attribute fails from now on, so that __getattr__ is called
                values.setdefault(ON_DEMAND, {})[name] = values.pop(name)

    def __getattr__(self, name: str) -> Any:
        given = None if name.startswith("__") else waiting(self).get(name)
        if given is None or given.make is None:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        value = given.make()
        self.__dict__[name] = value = _read_only(value) if isinstance(value, np.ndarray) else value
        return value

    def __getstate__(self) -> dict[str, Any]:
        """Return all fields, computed, and the grids: what computes them cannot be pickled."""
        state = {name: getattr(self, name) for name in self.__dataclass_fields__}
        grids = {name: OnDemand(None, given.grid) for name, given in waiting(self).items()}
        return {**state, ON_DEMAND: grids} if grids else state

    def __setstate__(self, state: dict[str, Any]) -> None:
        # pickling forgets that arrays are read-only
        for name, value in state.items():
            self.__dict__[name] = _read_only(value) if isinstance(value, np.ndarray) else value

    def full(self, name: str) -> NDArray[Any]:
        """Return a field at the size of the image, interpolated if it lives on a coarser grid.

        Interpolation is bilinear between the centres of the cells.

        Parameters
        ----------
        name : str
            A field over ``y`` and ``x``. Another field of the quantity has the size of the image.
        """
        images = [getattr(self, f.name) for f in _images(type(self)) if not f.spec.coarse]
        sizes = [image.shape[:2] for image in images if image is not None]
        values: NDArray[Any] = getattr(self, name)
        return values if not sizes else enlarge_cells(values, sizes[0])

    def arrays(self) -> Arrays:
        """Return named arrays from which :meth:`from_arrays` rebuilds the quantity.

        Fields that are None are left out, unless their ``if_none`` is set. Subclasses may add
        arrays for other programs.
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
        """Rebuild the quantity from the result of :meth:`arrays`.

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
        """Return a copy with 0 in place of values that are not finite, marked as not valid.

        Quantities from the steps of a pipeline are finite already.
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
        """Return the layers to draw in the image; by default derived from the fields."""
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
        """Return JSON-ready values for a line of ``tactile run --json``; by default the scalars."""
        found: dict[str, list[Any]] = {}
        for field in fields_of(type(self)):
            if field.form in (bool, int, float, str) and not field.spec.shared:
                found.setdefault(field.spec.saved_as, []).append(getattr(self, field.name))
        return {name: values[0] if len(values) == 1 else values for name, values in found.items()}

    def text(self) -> str:
        """Return the words for a line of ``tactile run``; empty by default."""
        return ""

    def warnings(self) -> tuple[str, ...]:
        """Return messages that a reading passes on to the user."""
        return ()


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    if not array.flags.writeable:
        return array
    view = array.view()
    view.setflags(write=False)
    return view


def pass_errors(_: Quantity) -> AbstractContextManager[None]:
    """Return a context manager that lets errors of a quantity's code pass."""
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
