"""The annotation of a field describes it, and results are checked against it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.errors import PluginError
from tactile_core.quantities import (
    Bool,
    DisplacementField,
    FieldSpec,
    Float32,
    HeightMap,
    MmPerPx,
    Quantity,
    SlipState,
    TimestampS,
)
from tactile_core.quantities.array_form import form_fault
from tactile_core.quantities.fields import Outline, Points, ScalarMap, VectorMap, fields_of

SHAPE = (6, 8)


@dataclass(frozen=True, eq=False)
class Friction(Quantity):
    """Every kind of field."""

    coefficient: Annotated[Float32, FieldSpec("1", ("y", "x"))]
    std: Annotated[Float32 | None, FieldSpec("1", ("y", "x"), std_of="coefficient")]
    valid: Annotated[Bool, FieldSpec(axes=("y", "x"), validity=True)]
    slides: Annotated[Bool, FieldSpec(axes=("y", "x"))]
    traction: Annotated[Float32, FieldSpec("N/mm²", ("y", "x", "xy"), coarse=True)]
    grains_px: Annotated[Float32, FieldSpec("px", ("grain", "xy"))]
    sizes: Annotated[NDArray[np.int32], FieldSpec(axes=("grain",))]
    mean: Annotated[float, FieldSpec("1", saved_as="mean_friction")]
    spread: Annotated[float | None, FieldSpec("1", saved_as="friction_spread", if_none=0.0)]
    mode: Literal["dry", "wet"]
    anything: NDArray[Any]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0


def friction(**changed: Any) -> Friction:
    plane = np.ones(SHAPE, np.float32)
    valid = Friction(
        plane,
        0.1 * plane,
        plane > 0,
        plane > 2,
        np.ones((3, 4, 2), np.float32),
        np.zeros((5, 2), np.float32),
        np.zeros(5, np.int32),
        0.4,
        None,
        "dry",
        np.arange(3),
        0.1,
    )
    return replace(valid, **changed)


def test_type_and_dtype_are_read_from_the_annotation() -> None:
    found = {field.name: (field.form, field.dtype, field.optional) for field in fields_of(Friction)}
    assert found["coefficient"] == (np.ndarray, np.float32, False)
    assert found["std"] == (np.ndarray, np.float32, True)
    assert found["sizes"] == (np.ndarray, np.int32, False)
    assert found["anything"] == (np.ndarray, None, False)
    assert found["mean"] == (float, None, False)
    assert found["spread"] == (float, None, True)
    assert found["mode"] == (str, None, False)


def test_the_name_in_files_defaults_to_type_and_field() -> None:
    names = {field.name: field.spec.saved_as for field in fields_of(Friction)}
    assert names["mean"] == "mean_friction"
    assert names["coefficient"] == "Friction.coefficient"


def test_a_quantity_as_described_has_no_fault() -> None:
    assert form_fault(friction(), SHAPE) == ""
    assert form_fault(friction(std=None, spread=0.1), SHAPE) == ""


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"coefficient": np.ones(SHAPE)}, "coefficient is float64 where it must be float32"),
        ({"coefficient": None}, "coefficient is NoneType where it must be float32"),
        ({"coefficient": [1.0]}, "coefficient is list where it must be float32"),
        ({"std": np.ones((2, 2), np.float32)}, r"std has the shape (2, 2) where the image has"),
        ({"coefficient": np.full(SHAPE, np.nan, np.float32)}, "values that are not finite"),
        ({"coefficient": np.full(SHAPE, 1e30, np.float32)}, "coefficient holds values above 1e+15"),
        ({"traction": np.ones((9, 4, 2), np.float32)}, "traction has the shape (9, 4, 2) where"),
        ({"traction": np.ones((3, 4, 3), np.float32)}, "traction has the shape (3, 4, 3) where"),
        ({"sizes": np.zeros(4, np.int32)}, "sizes has the shape (4,) where the quantity has (5,)"),
        ({"mean": float("nan")}, "mean is nan where it must be a number"),
        ({"mean": "much"}, "mean is 'much' where it must be a number"),
        ({"anything": np.array([1.0, np.inf])}, "anything holds values that are not finite"),
    ],
)
def test_a_field_that_differs_from_its_description_is_named(
    changed: dict[str, Any], message: str
) -> None:
    assert message in form_fault(friction(**changed), SHAPE)
    assert form_fault(friction(**changed), SHAPE).startswith("Friction.")


def test_quantities_of_the_core_are_checked_too() -> None:
    flat = HeightMap(np.zeros(SHAPE, np.float32), np.ones(SHAPE, np.bool_), 0.1)
    assert form_fault(flat, SHAPE) == ""
    assert form_fault(flat, (3, 8)).startswith("HeightMap.mm has the shape (6, 8)")
    assert form_fault(SlipState("stick", float("nan"))).startswith("SlipState.degree is nan")


def test_a_coarse_field_is_interpolated_to_the_image() -> None:
    traction = friction().full("traction")
    assert traction.shape == (*SHAPE, 2)
    assert traction == pytest.approx(1)
    fine = friction(traction=np.ones((*SHAPE, 2), np.float32))
    assert fine.full("traction") is fine.traction


def test_a_ramp_on_a_coarse_grid_is_the_same_ramp_between_the_centres_of_its_cells() -> None:
    cells = np.zeros((4, 8, 2), np.float32)
    cells[..., 0] = np.arange(8) * 10.0  # x of each cell's centre is 10 n + 4.5 px
    field = DisplacementField(cells, np.ones((40, 80), np.bool_), 0.1)
    x = np.arange(5, 75)
    np.testing.assert_allclose(field.mm[20, 5:75, 0], x - 4.5, atol=1e-4)
    assert field.mm.shape == (40, 80, 2)


def test_layers_follow_from_the_fields() -> None:
    kinds = [type(layer) for layer in friction().layers()]
    assert kinds == [ScalarMap, Outline, VectorMap, Points]


def test_the_summary_holds_the_scalars() -> None:
    assert friction().summary() == {
        "mean_friction": 0.4,
        "friction_spread": None,
        "Friction.mode": "dry",
    }


@dataclass(frozen=True, eq=False)
class Lost(Quantity):
    """Its annotation refers to an undefined name."""

    value: Missing  # type: ignore[name-defined]  # noqa: F821


def test_annotations_that_cannot_be_read_are_reported() -> None:
    with pytest.raises(PluginError, match=r"the quantity Lost cannot be read .*'Missing'"):
        fields_of(Lost)


@dataclass(frozen=True, eq=False)
class Tabular(Quantity):
    """An array cannot hold its field."""

    table: Mapping[str, int]


def test_a_field_that_is_no_array_is_left_out_of_form_summary_and_layers() -> None:
    table = Tabular({"a": 1})
    assert form_fault(table) == ""
    assert table.summary() == {}
    assert table.layers() == ()
