"""Arrays of a quantity that are computed when somebody reads them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, NamedTuple, TypeVar, cast

from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import interpolate_cells
from tactile_core.algorithms.arrays.types import Float32

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
