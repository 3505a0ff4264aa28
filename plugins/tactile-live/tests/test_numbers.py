"""Numbers of any quantity, with titles and units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import (
    FieldSpec,
    Frame,
    Friction,
    HeightMap,
    NetworkOutput,
    Quantity,
    RelativeLoad,
    SlipState,
    Wrench,
)
from tactile_live.numbers import Entry, entries_of


@dataclass(frozen=True, eq=False)
class Warmth(Quantity):
    """A stranger's quantity."""

    mean: Annotated[float, FieldSpec("°C")]
    fingers_n: Annotated[Any, FieldSpec("N")] = 0.0
    touched: bool = False
    material: str = ""


@dataclass(frozen=True, eq=False)
class Load(Quantity):
    """Another stranger's quantity, of arrays."""

    wrench: Annotated[np.ndarray[Any, np.dtype[np.float32]], FieldSpec("N", ("component",))]
    spectrum: Annotated[np.ndarray[Any, np.dtype[np.float32]], FieldSpec("mm", ("frequency",))]


@dataclass(frozen=True, eq=False)
class Broken(Quantity):
    """A quantity whose summary fails."""

    value: float = 0.0

    def summary(self) -> dict[str, Any]:
        raise ZeroDivisionError("oops")


def reading(*quantities: Quantity) -> Reading:
    frame = Frame(np.zeros((4, 6, 3), np.uint8), ("red", "green", "blue"), 0.1)
    return Reading(frame, {type(one): one for one in quantities}, {})


def entries(*quantities: Quantity) -> dict[str, Entry]:
    found, faults = entries_of(reading(*quantities))
    assert faults == []
    return {entry.key: entry for entry in found}


def test_the_cores_numbers_have_the_units_of_their_names() -> None:
    height = HeightMap(np.ones((4, 6), np.float32), np.ones((4, 6), np.bool_), 0.1)
    found = entries(height, SlipState("slip", 0.5, rotation_deg=3.0))
    assert found["max_height_mm"] == Entry("max_height_mm", "max height", "mm", 1.0, True)
    assert found["slip.degree"] == Entry("slip.degree", "slip degree", "", 0.5, True)
    assert entries(RelativeLoad(0.25))["load"] == Entry("load", "load", "", 0.25, True)
    assert found["slip.rotation_deg"].unit == "°"
    assert found["slip.state"].value == "slip"
    assert not found["slip.state"].is_number


def test_a_force_has_named_deviations_in_the_units_of_its_parts() -> None:
    found = entries(Wrench(0.1, 0.2, 1.5, 0.3, 0.01, 0.02, 0.03, 0.05))
    shown = {entry.title: (entry.unit, entry.value) for entry in found.values()}
    assert shown["wrench fz"] == ("N", 1.5)
    assert shown["wrench fz std"] == ("N", 0.03)
    assert shown["wrench tz std"] == ("N·mm", 0.05)


def test_friction_is_shown_with_its_margin() -> None:
    found = entries(Friction(0.6, 0.05, 0.2))
    assert found["slip.friction"].value == 0.6
    assert found["slip.margin"].value == 0.2


def test_the_values_of_a_network_have_its_names_and_its_unit() -> None:
    found = entries(NetworkOutput(np.array([0.5, 1.0], np.float32), ("grip", "pull"), "N"))
    grip = found["network.values.grip"]
    assert (grip.title, grip.unit, grip.value) == ("network values grip", "N", 0.5)
    assert found["network.unit"].unit == ""


def test_a_strangers_numbers_have_the_units_of_their_descriptions() -> None:
    found = entries(Warmth(36.6, touched=True, material="wood"))
    assert found["Warmth.mean"] == Entry("Warmth.mean", "warmth mean", "°C", 36.6, True)
    assert found["Warmth.material"].value == "wood"
    assert found["Warmth.touched"].value is True
    assert not found["Warmth.touched"].is_number


def test_a_short_row_is_a_handful_of_numbers_and_a_long_one_a_curve() -> None:
    found = entries(Load(np.array([1, 2, 3], np.float32), np.zeros(64, np.float32)))
    assert [found[f"Load.wrench.{n}"].value for n in (1, 2, 3)] == [1.0, 2.0, 3.0]
    assert found["Load.wrench.1"].unit == "N"
    assert len(found["Load.spectrum"].value) == 64


def test_what_is_not_finite_is_not_known() -> None:
    assert entries(Warmth(float("nan")))["Warmth.mean"].value is None


def test_a_quantity_whose_code_fails_is_left_out_with_a_sentence() -> None:
    found, faults = entries_of(reading(Broken(), Warmth(1.0)))
    assert [entry.key for entry in found][:1] == ["Warmth.mean"]
    assert len(faults) == 1
    assert "the quantity Broken" in faults[0]
    assert "oops" in faults[0]
