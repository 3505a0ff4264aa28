"""Types of arrays, annotations of arrays, and places in them."""

from __future__ import annotations

import types
from functools import lru_cache
from typing import Any, NamedTuple, Union, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Bool = NDArray[np.bool_]
Complex64 = NDArray[np.complex64]
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Intp = NDArray[np.intp]
UInt8 = NDArray[np.uint8]

TINY = 1e-12  # Added to denominators against division by zero


class Parts(NamedTuple):
    """What an annotation admits.

    Attributes
    ----------
    members : tuple
        The types of the union, or the one type; ``NoneType`` among them if None is admitted.
    extras : tuple
        The metadata of ``Annotated``, the outermost last.
    """

    members: tuple[Any, ...]
    extras: tuple[Any, ...]

    @property
    def types(self) -> tuple[Any, ...]:
        """The members without None."""
        return tuple(member for member in self.members if member is not types.NoneType)


def parts(annotation: Any) -> Parts:
    """Take an annotation apart, whatever aliases it is written with.

    ``type X = …`` makes an object of its own from Python 3.12 on, and numpy's ``NDArray`` is one
    from numpy 2.5 on; nothing in it can be read without asking for its value.
    """
    origin, args = get_origin(annotation), get_args(annotation)
    if _is_alias(annotation):
        return parts(annotation.__value__)
    if _is_alias(origin):
        return parts(_with_arguments(origin, args))
    if hasattr(annotation, "__metadata__"):
        within = parts(annotation.__origin__)
        return Parts(within.members, (*within.extras, *annotation.__metadata__))
    if origin in (Union, types.UnionType):
        each = [parts(arg) for arg in args]
        return Parts(
            tuple(member for found in each for member in found.members),
            tuple(extra for found in each for extra in found.extras),
        )
    return Parts((annotation,), ())


def _is_alias(annotation: Any) -> bool:
    # by name: before Python 3.14, typing_extensions has a class of its own
    return type(annotation).__name__ == "TypeAliasType"


def _with_arguments(alias: Any, args: tuple[Any, ...]) -> Any:
    given = dict(zip(alias.__type_params__, args, strict=False))
    value = alias.__value__
    if value in alias.__type_params__:
        return given.get(value, value)
    within = getattr(value, "__parameters__", ())
    return value[tuple(given.get(one, one) for one in within)] if within else value


@lru_cache(maxsize=16)
def from_middle(count: int) -> NDArray[np.float64]:
    """Coordinate of each of ``count`` pixels in a line, relative to its middle, (count,)."""
    places = np.asarray(np.arange(count) - (count - 1) / 2)
    places.setflags(write=False)
    return places


def nodes(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Column and row of every pixel, (h, w, 2)."""
    return np.indices(shape, np.float32)[::-1].transpose(1, 2, 0).copy()


def rasterise_points(points: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Rasterise points (N, 2), some perhaps outside: (h, w), 1 at their pixels and 0 elsewhere."""
    image = np.zeros(shape, np.uint8)
    columns, rows = np.rint(points.T).astype(np.intp)
    # a negative place is large without its sign
    inside = (columns.view(np.uintp) < shape[1]) & (rows.view(np.uintp) < shape[0])
    image.ravel()[(rows * shape[1] + columns)[inside]] = 1
    return image


def spacings(points: Array) -> Array:
    """Distance of each of (N, 2) points to its nearest neighbour, (N,); infinite for one point."""
    from scipy.spatial import KDTree

    found, _ = KDTree(points).query(points, k=[2])
    return np.asarray(found)[:, 0]


def pitch(points: Array) -> float:
    """Median distance to the nearest neighbour; infinite for a single point or none."""
    return float(np.median(spacings(points))) if len(points) else np.inf


def as_complex(pairs: Array) -> Complex64:
    """Convert (..., 2) float32 pairs to (...,) complex64."""
    return np.ascontiguousarray(pairs, np.float32).view(np.complex64)[..., 0]
