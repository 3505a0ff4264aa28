"""An alias means what it stands for, a plugin's and numpy's own."""

from __future__ import annotations

from dataclasses import dataclass
from types import NoneType
from typing import Annotated, Any, TypeVar

import numpy as np
import pytest
from typing_extensions import TypeAliasType

from tactile_core.algorithms.arrays.types import parts
from tactile_core.errors import PluginError
from tactile_core.quantities import FieldSpec, Quantity
from tactile_core.quantities.fields import fields_of

T = TypeVar("T")
Scalar = TypeVar("Scalar", bound=np.generic)

# as numpy 2.5 has it
Array = TypeAliasType("Array", np.ndarray[tuple[Any, ...], np.dtype[Scalar]], type_params=(Scalar,))
Single = TypeAliasType("Single", np.float32)
Height = TypeAliasType("Height", Annotated[Array[Single], FieldSpec("mm", ("y", "x"))])
Maybe = TypeAliasType("Maybe", T | None, type_params=(T,))
Point = TypeAliasType("Point", tuple[float, float])


@dataclass(frozen=True, eq=False)
class Bump(Quantity):
    """Every field is annotated with an alias."""

    mm: Height
    std_mm: Annotated[Maybe[Array[np.float64]], FieldSpec("mm", std_of="mm")]
    anything: Array  # type: ignore[type-arg]
    centre_px: Point
    title: Maybe[str] = None


def test_fields_are_described_through_aliases() -> None:
    mm, std_mm, anything, centre_px, title = fields_of(Bump)
    assert (mm.form, mm.dtype, mm.spec.unit) == (np.ndarray, np.float32, "mm")
    assert (std_mm.form, std_mm.dtype, std_mm.optional) == (np.ndarray, np.float64, True)
    assert (anything.form, anything.dtype) == (np.ndarray, None)
    assert (centre_px.form, title.form) == (tuple, str)


def test_the_outermost_description_of_a_field_holds() -> None:
    assert parts(Annotated[Height, "outer"]).extras[-1] == "outer"


def test_arguments_reach_the_places_of_their_parameters() -> None:
    other = TypeVar("other")
    swapped = TypeAliasType("swapped", dict[T, other], type_params=(other, T))
    assert parts(swapped[int, str]).members == (dict[str, int],)
    same = TypeAliasType("same", T, type_params=(T,))
    assert parts(same[int | None]).members == (int, NoneType)


def test_an_alias_of_what_does_not_exist_is_reported() -> None:
    @dataclass(frozen=True, eq=False)
    class Nowhere(Quantity):
        value: TypeAliasType("Gone", Gone)  # type: ignore # noqa: F821

    with pytest.raises(PluginError, match="the quantity Nowhere cannot be read"):
        fields_of(Nowhere)
