"""Descriptions of a quantity's arrays, and what of them a picture shows."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32, parts
from tactile_core.errors import PluginError

_SCALARS = (bool, int, float, str)


@dataclass(frozen=True)
class FieldSpec:
    """Annotation of a field that adds unit, axes and name in files to its type.

    For example ``mm: Annotated[Float32, FieldSpec("mm", ("y", "x"))]``. Without it, a field is
    described by its type alone.

    Attributes
    ----------
    unit : str
        ``"mm"``, ``"N"``, ``"deg"``; empty for dimensionless fields.
    axes : tuple of str, optional
        Meaning of each dimension of an array. ``y`` and ``x`` are the rows and columns of the
        image, ``xy`` and ``xyz`` the components of a vector. Other names are free; each has one
        length within a quantity.
    saved_as : str
        Name in files and in JSON; default ``Type.field``. Fields with the same name are stacked
        along a last axis.
    std_of : str
        Name of the field whose standard deviation this field holds.
    validity : bool
        True for the mask of measured values; elsewhere the other fields are filled in.
    coarse : bool
        True if the field may live on a coarser grid than the image: cells of equal size that tile
        it. :meth:`Quantity.full` interpolates it to the image.
    shared : bool
        True if all quantities of a reading have the same value, such as the scale.
    if_none : float, optional
        Value in files if the field is None. Default: the field is left out.
    """

    unit: str = ""
    axes: tuple[str, ...] | None = None
    saved_as: str = ""
    std_of: str = ""
    validity: bool = False
    coarse: bool = False
    shared: bool = False
    if_none: float | None = None


MmPerPx = Annotated[float, FieldSpec("mm/px", saved_as="mm_per_px", shared=True)]
TimestampS = Annotated[float, FieldSpec("s", saved_as="timestamp_s", shared=True)]


@dataclass(frozen=True)
class Field:
    """One field of a quantity, read from its annotation.

    Attributes
    ----------
    name : str
    spec : FieldSpec
        With ``saved_as`` filled in.
    form : type
        ``numpy.ndarray``, ``tuple``, ``bool``, ``int``, ``float`` or ``str``; ``object`` for
        everything that an array cannot hold.
    dtype : numpy.dtype or None
        Type of an array's elements; None if the annotation leaves it open.
    optional : bool
        Whether it may be None.
    default : object
        ``dataclasses.MISSING`` if the field is required.
    """

    name: str
    spec: FieldSpec
    form: type
    dtype: np.dtype[Any] | None
    optional: bool
    default: Any

    @property
    def is_array(self) -> bool:
        """Whether the field is an array."""
        return self.form is np.ndarray

    def describe_field(self) -> dict[str, Any]:
        """Return the description as JSON-ready values, for files and streams."""
        spec = self.spec
        entries = {
            "saved_as": spec.saved_as,
            "unit": spec.unit,
            "axes": None if spec.axes is None else list(spec.axes),
            "type": str(self.dtype or "array") if self.is_array else self.form.__name__,
            "std_of": spec.std_of,
            "validity": spec.validity,
        }
        return {key: value for key, value in entries.items() if value not in (None, "", False)}


def fields_of(kind: type[Any]) -> tuple[Field, ...]:
    """Return the fields of a quantity's class, in order.

    Raises
    ------
    PluginError
        The annotations of the class cannot be read.
    """
    # for type checkers: a class is hashable even if its instances are not
    hashable: Any = kind
    return _fields_of(hashable)


@cache
def _fields_of(kind: type[Any]) -> tuple[Field, ...]:
    try:
        hints = get_type_hints(kind, include_extras=True)
        return tuple(
            _make_field(kind, field.name, hints[field.name], field.default)
            for field in dataclasses.fields(kind)
        )
    except Exception as error:  # evaluating annotations runs arbitrary code
        raise PluginError(
            f"the annotations of the quantity {kind.__name__} cannot be read ({error}); import "
            f"their types at run time, not only under TYPE_CHECKING"
        ) from error


def _make_field(kind: type[Any], name: str, annotation: Any, default: Any) -> Field:
    found = parts(annotation)
    spec = next((e for e in reversed(found.extras) if isinstance(e, FieldSpec)), FieldSpec())
    form, dtype = _form(found.types[0]) if len(found.types) == 1 else (object, None)
    spec = dataclasses.replace(spec, saved_as=spec.saved_as or f"{kind.__name__}.{name}")
    return Field(name, spec, form, dtype, found.types != found.members, default)


def _form(annotation: Any) -> tuple[type, np.dtype[Any] | None]:
    origin, args = get_origin(annotation), get_args(annotation)
    if annotation is np.ndarray or origin is np.ndarray:
        held = get_args(_plain(args[1])) if len(args) > 1 else ()
        scalar = _plain(held[0]) if held else Any
        known = isinstance(scalar, type) and issubclass(scalar, np.generic)
        return np.ndarray, np.dtype(scalar) if known else None
    if origin is Literal:
        return type(args[0]), None
    if origin is tuple and all(_plain(arg) in (*_SCALARS, Ellipsis) for arg in args):
        return tuple, None
    if annotation in _SCALARS:
        return annotation, None
    return object, None


def _plain(annotation: Any) -> Any:
    """Return the one type that an annotation means; None if it means several."""
    members = parts(annotation).members
    return members[0] if len(members) == 1 else None


@dataclass(frozen=True, eq=False)
class Surface:
    """A height map, drawn as shaded relief.

    Attributes
    ----------
    mm : (H, W) float32
        Finite; larger is nearer to the camera.
    mm_per_px : float
    title : str
    """

    mm: Float32
    mm_per_px: float
    title: str = "height"


@dataclass(frozen=True, eq=False)
class ScalarMap:
    """One number per pixel, drawn in colours with a colour bar.

    Attributes
    ----------
    values : (H, W) of any real dtype
        Finite values.
    unit : str
    title : str
    """

    values: NDArray[Any]
    unit: str = ""
    title: str = ""


@dataclass(frozen=True, eq=False)
class VectorMap:
    """One in-plane vector per pixel, drawn as its magnitude with arrows.

    Attributes
    ----------
    values : (H, W, 2) float32
        Finite; +x right, +y down.
    valid : (H, W) bool or None
        Where it is False, the map is drawn paler and without arrows.
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
        Drawn with the area of the region.
    """

    mask: Bool
    title: str = "contact"


@dataclass(frozen=True, eq=False)
class Points:
    """Points of the image, drawn over the maps, or over the frame if there are no maps.

    Attributes
    ----------
    px : (N, 2) float32
        x and y; points that are not finite are not drawn.
    title : str
    from_px : (N, 2) float32 or None
        Earlier position of each point, from which an arrow is drawn.
    reliable : (N,) bool or None
        Points that are not reliable are drawn hollow.
    """

    px: Float32
    title: str = ""
    from_px: Float32 | None = None
    reliable: Bool | None = None


Layer = Surface | ScalarMap | VectorMap | Outline | Points
