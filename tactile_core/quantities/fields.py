"""What each field of a quantity holds: unit, axes, dtype, and the name it has in files."""

from __future__ import annotations

import dataclasses
import types
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from tactile_core.errors import PluginError

_SCALARS = (bool, int, float, str)


@dataclass(frozen=True)
class FieldSpec:
    """What an annotation says of a field beside its type.

    For example ``mm: Annotated[Float32, FieldSpec("mm", ("y", "x"))]``. A field without one is
    described by its type alone.

    Attributes
    ----------
    unit : str
        ``"mm"``, ``"N"``, ``"deg"``; empty where there is none.
    axes : tuple of str, optional
        What each dimension of an array runs over. ``y`` and ``x`` are the rows and columns of the
        image, ``xy`` and ``xyz`` the components of a vector; any other name is the author's, and
        has one length within a quantity.
    saved_as : str
        Name in files and in JSON; ``Type.field`` if left out. Fields of one name are stacked along
        a last axis.
    std_of : str
        The field of which this is the standard deviation.
    validity : bool
        Whether it says where the other fields are measured, and not filled in.
    coarse : bool
        Whether ``y`` and ``x`` may be fewer than the image's rows and columns: cells of equal size
        that tile the image. :meth:`Quantity.full` enlarges them.
    shared : bool
        Whether all quantities of a reading have the same value, such as the scale.
    if_none : float, optional
        What files hold where the field is None, if they must hold something.
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
    """One field of a quantity, as its annotation describes it.

    Attributes
    ----------
    name : str
    spec : FieldSpec
        With ``saved_as`` filled in.
    form : type
        ``numpy.ndarray``, ``tuple``, ``bool``, ``int``, ``float`` or ``str``; ``object`` for what
        no array can hold.
    dtype : numpy.dtype or None
        Of an array; None where the annotation leaves it open.
    optional : bool
        Whether it may be None.
    default : object
        ``dataclasses.MISSING`` where it has to be given.
    """

    name: str
    spec: FieldSpec
    form: type
    dtype: np.dtype[Any] | None
    optional: bool
    default: Any

    @property
    def is_array(self) -> bool:
        """Whether it is an array."""
        return self.form is np.ndarray

    def described(self) -> dict[str, Any]:
        """Return what it holds, as JSON can say it: for files and for whoever streams it."""
        spec = self.spec
        said = {
            "saved_as": spec.saved_as,
            "unit": spec.unit,
            "axes": None if spec.axes is None else list(spec.axes),
            "type": str(self.dtype or "array") if self.is_array else self.form.__name__,
            "std_of": spec.std_of,
            "validity": spec.validity,
        }
        return {key: value for key, value in said.items() if value not in (None, "", False)}


def fields_of(kind: type[Any]) -> tuple[Field, ...]:
    """Return the fields of a quantity's type, in order.

    Raises
    ------
    PluginError
        The annotations of the class cannot be read.
    """
    # checkers do not know that a class whose instances do not hash does
    hashable: Any = kind
    return _fields_of(hashable)


@cache
def _fields_of(kind: type[Any]) -> tuple[Field, ...]:
    try:
        hints = get_type_hints(kind, include_extras=True)
    except Exception as error:  # evaluating annotations runs whatever they say
        raise PluginError(
            f"the annotations of the quantity {kind.__name__} cannot be read ({error}); import "
            f"their types at run time, not only under TYPE_CHECKING"
        ) from error
    return tuple(
        _described(kind, field.name, hints[field.name], field.default)
        for field in dataclasses.fields(kind)
    )


def _described(kind: type[Any], name: str, annotation: Any, default: Any) -> Field:
    spec, optional = FieldSpec(), False
    while True:
        if hasattr(annotation, "__metadata__"):
            said = [extra for extra in annotation.__metadata__ if isinstance(extra, FieldSpec)]
            spec, annotation = (said or [spec])[-1], annotation.__origin__
        elif get_origin(annotation) in (Union, types.UnionType):
            members = [m for m in get_args(annotation) if m is not type(None)]
            optional = len(members) < len(get_args(annotation))
            if len(members) > 1:
                annotation = object
                break
            annotation = members[0]
        else:
            break
    form, dtype = _form(annotation)
    spec = dataclasses.replace(spec, saved_as=spec.saved_as or f"{kind.__name__}.{name}")
    return Field(name, spec, form, dtype, optional, default)


def _form(annotation: Any) -> tuple[type, np.dtype[Any] | None]:
    origin, args = get_origin(annotation), get_args(annotation)
    if annotation is np.ndarray or origin is np.ndarray:
        scalar = get_args(args[1])[0] if len(args) > 1 and get_args(args[1]) else Any
        known = isinstance(scalar, type) and issubclass(scalar, np.generic)
        return np.ndarray, np.dtype(scalar) if known else None
    if origin is Literal:
        return type(args[0]), None
    if origin is tuple and all(arg in (*_SCALARS, Ellipsis) for arg in args):
        return tuple, None
    if annotation in _SCALARS:
        return annotation, None
    return object, None
