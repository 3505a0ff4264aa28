"""Quantities, including those of plugins, are restored from the arrays of one file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.readings import ONES, SHAPE, contact, height, markers, shear, slopes

from tactile_core.errors import InputError
from tactile_core.formats.npz import (
    DESCRIPTION,
    arrays_of,
    quantities_in,
    read_quantities,
    write_npz,
)
from tactile_core.quantities import (
    Bool,
    FieldSpec,
    Float32,
    MarkerDetections,
    MmPerPx,
    Quantity,
    SlipState,
    TimestampS,
)


@dataclass(frozen=True, eq=False)
class Temperature(Quantity):
    """Temperature of the gel surface."""

    kelvin: Annotated[Float32, FieldSpec("K", ("y", "x"))]
    std_kelvin: Annotated[Float32 | None, FieldSpec("K", ("y", "x"), std_of="kelvin")]
    valid: Annotated[Bool, FieldSpec(axes=("y", "x"), validity=True)]
    spectrum: Annotated[Float32, FieldSpec("W", ("wavelength",), saved_as="spectrum_w")]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0
    mode: str = "slow"
    notes: tuple[str, ...] = ()


def temperature(**changed: Any) -> Temperature:
    plane = np.linspace(290, 300, 48, dtype=np.float32).reshape(SHAPE)
    values: dict[str, Any] = {
        "kelvin": plane,
        "std_kelvin": plane / 100,
        "valid": plane > 292,
        "spectrum": np.arange(5, dtype=np.float32),
        "mm_per_px": 0.1,
        "timestamp_s": 7.0,
        "mode": "fast",
        "notes": ("warm", "dry"),
    }
    return Temperature(**{**values, **changed})


def assert_same(restored: Quantity, original: Quantity) -> None:
    assert type(restored) is type(original)
    for field in fields(original):
        np.testing.assert_array_equal(getattr(restored, field.name), getattr(original, field.name))
        assert type(getattr(restored, field.name)) is type(getattr(original, field.name))


def through_arrays(*quantities: Quantity) -> dict[type[Quantity], Quantity]:
    return quantities_in(arrays_of(quantities, mm_per_px=0.1), *map(type, quantities))


@pytest.mark.parametrize(
    "quantity",
    [
        slopes(),
        height(valid=ONES & (np.arange(8) > 3)),
        contact(),
        markers(),
        shear(),
        MarkerDetections(np.float32([[1, 2]]), np.array([True]), 3.0),
        SlipState("slip", 0.9, "rotation", 2.5, -3.0, 1.25, 4.5),
        SlipState("none", 0.0),
        temperature(),
        temperature(std_kelvin=None, notes=(), mode="slow"),
    ],
    ids=lambda quantity: type(quantity).__name__,
)
def test_a_quantity_is_restored_from_its_arrays(quantity: Quantity) -> None:
    assert_same(through_arrays(quantity)[type(quantity)], quantity)


@given(
    degree=st.floats(0, 1),
    entropy=st.none() | st.floats(0, 8),
    rotation=st.none() | st.floats(-90, 90),
    onset=st.none() | st.floats(0, 1e6),
)
def test_unknown_values_stay_unknown(
    degree: float, entropy: float | None, rotation: float | None, onset: float | None
) -> None:
    slip = SlipState("stick", degree, None, entropy, rotation, onset)
    assert_same(through_arrays(slip)[SlipState], slip)


def test_all_quantities_of_a_reading_are_restored_from_one_file(tmp_path: Path) -> None:
    originals = [slopes(), height(), contact(), markers(), shear(), temperature()]
    write_npz(tmp_path / "a.npz", arrays_of(originals, mm_per_px=0.1))
    restored = read_quantities(tmp_path / "a.npz", *map(type, originals), SlipState)
    assert set(restored) == set(map(type, originals))  # without slip, which was not measured
    for quantity in originals:
        assert_same(restored[type(quantity)], quantity)


def test_the_file_describes_unit_axes_and_dtype_of_each_field() -> None:
    arrays = arrays_of([temperature()], mm_per_px=0.1)
    described = json.loads(arrays[DESCRIPTION].tobytes())["Temperature"]["fields"]
    assert described["kelvin"] == {
        "saved_as": "Temperature.kelvin",
        "unit": "K",
        "axes": ["y", "x"],
        "type": "float32",
    }
    assert described["std_kelvin"]["std_of"] == "kelvin"
    assert described["valid"]["validity"] is True


@dataclass(frozen=True, eq=False)
class Rival(Quantity):
    """A plugin's quantity that uses an array name of the core, and one of its own."""

    height: Annotated[float, FieldSpec("m", saved_as="height_mm")] = 7.0

    def arrays(self) -> Mapping[str, np.ndarray]:
        return {**super().arrays(), "peak": np.array(1)}


def test_different_arrays_with_the_same_name_are_prefixed_with_their_type() -> None:
    rival = Rival(8.0)
    arrays = arrays_of([height(), rival], mm_per_px=0.1)
    assert arrays["height_mm"].shape == SHAPE
    assert arrays["Rival.height_mm"] == 8.0
    assert arrays["peak"] == 1
    assert_same(quantities_in(arrays, Rival)[Rival], rival)


def test_scale_is_always_saved_and_validity_if_known() -> None:
    assert arrays_of([], mm_per_px=0.25)["mm_per_px"] == 0.25
    assert arrays_of([slopes()], mm_per_px=0.1)["valid"].all()


@dataclass(frozen=True, eq=False)
class Invalid(Quantity):
    """A quantity with a field that cannot be an array."""

    table: Mapping[str, int]


def test_a_field_that_is_not_an_array_is_rejected_by_name() -> None:
    refused = r"Invalid\.table is a dict, which no array can hold; annotate"
    with pytest.raises(TypeError, match=refused):
        arrays_of([Invalid({"a": 1})], mm_per_px=0.1)


@pytest.mark.parametrize(
    "arrays",
    [
        {},
        {DESCRIPTION: np.zeros(4, np.uint8)},
        {DESCRIPTION: np.frombuffer(b"[]", np.uint8)},
        {DESCRIPTION: np.frombuffer(b'{"HeightMap": {"arrays": {}, "none": []}}', np.uint8)},
        {DESCRIPTION: np.frombuffer(b'{"HeightMap": 3}', np.uint8)},
    ],
)
def test_arrays_without_a_valid_description_are_rejected(arrays: dict[str, np.ndarray]) -> None:
    with pytest.raises(InputError, match=r"not the arrays of a reading|no array 'height_mm'"):
        quantities_in(arrays, type(height()))
