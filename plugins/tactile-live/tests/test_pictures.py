"""Frames and layers in the form that the browser draws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.watching import Message

from tactile_core.quantities import (
    ContactMask,
    ContactStress,
    DisplacementField,
    FieldSpec,
    Frame,
    Gradients,
    HeightMap,
    Quantity,
)
from tactile_core.quantities.fields import Outline, Points, ScalarMap, VectorMap
from tactile_live import pictures
from tactile_live.commands import MessageParts

SHAPE = (48, 64)


@dataclass(frozen=True, eq=False)
class Temperature(Quantity):
    """A stranger's quantity, which says nothing about how it is drawn."""

    map: Annotated[NDArray[np.float32], FieldSpec("°C", ("y", "x"))]
    hottest: Annotated[NDArray[np.float32], FieldSpec("px", ("spot", "xy"))]


@dataclass(frozen=True, eq=False)
class Undrawable(Quantity):
    """A quantity whose layers fail."""

    value: float = 0.0

    def layers(self) -> Any:
        raise RuntimeError("no pencil")


def gradients() -> Gradients:
    x = np.linspace(-1, 1, SHAPE[0] * SHAPE[1], dtype=np.float32).reshape(SHAPE)
    return Gradients(x, -x, np.ones(SHAPE, np.bool_), 0.1)


def height() -> HeightMap:
    return HeightMap(np.ones(SHAPE, np.float32), np.ones(SHAPE, np.bool_), 0.1)


def test_surfaces_come_first_and_what_draws_nothing_is_drawn_by_its_fields_last() -> None:
    spots = np.array([[1, 2], [3, 4]], np.float32)
    warm = Temperature(np.ones(SHAPE, np.float32), spots)
    layers, faults = pictures.layers_of([gradients(), warm, height()])
    assert faults == []
    assert [one["title"] for one in pictures.titles(layers)] == [
        "height",
        "Temperature map",
        "Gradients x",
        "Gradients y",
    ]
    assert pictures.titles(layers)[1]["unit"] == "°C"


def test_stress_has_maps_of_pressure_and_of_shear() -> None:
    pressure, shear = np.ones(SHAPE, np.float32), np.zeros((*SHAPE, 2), np.float32)
    stress = ContactStress(pressure, shear, np.ones(SHAPE, np.bool_), 0.1)
    layers, faults = pictures.layers_of([stress])
    assert faults == []
    assert [(one.layer.title, one.layer.unit) for one in layers] == [
        ("pressure", "MPa"),
        ("shear stress", "MPa"),
    ]


def test_a_quantity_that_cannot_be_drawn_is_left_out_with_a_sentence() -> None:
    layers, faults = pictures.layers_of([Undrawable(), height()])
    assert [one.layer.title for one in layers] == ["height"]
    assert "the quantity Undrawable" in faults[0]
    assert "no pencil" in faults[0]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("count", [1, 3, 6])
@pytest.mark.parametrize("channel", [None, 0])
def test_every_kind_of_frame_has_a_picture(dtype: Any, count: int, channel: int | None) -> None:
    scale = 255 if dtype is np.uint8 else 4095
    pixels = np.full((*SHAPE, count), scale // 2, dtype)
    frame = Frame(pixels, tuple("abcdef"[:count]), 0.1, full_scale=scale)
    parts = MessageParts()
    place = pictures.picture(frame, channel, parts)
    message = Message(parts.message({}))
    shown = cv2.imdecode(np.frombuffer(message.bytes(place), np.uint8), cv2.IMREAD_UNCHANGED)
    assert shown.shape[:2] == SHAPE
    assert abs(float(shown.mean()) - 127) < 3


def test_colours_are_not_swapped() -> None:
    pixels = np.zeros((*SHAPE, 3), np.uint8)
    pixels[..., 0] = 200
    parts = MessageParts()
    place = pictures.picture(Frame(pixels, ("red", "green", "blue"), 0.1), None, parts)
    encoded = np.frombuffer(Message(parts.message({})).bytes(place), np.uint8)
    blue, green, red = cv2.imdecode(encoded, cv2.IMREAD_COLOR).reshape(-1, 3).mean(axis=0)
    assert red > 190
    assert max(blue, green) < 20


def test_a_large_map_is_reduced_and_keeps_its_range() -> None:
    values = np.zeros((960, 1280), np.float32)
    values[400:500, 600:700] = 2.5
    parts = MessageParts()
    described = pictures.map_of(pictures.NamedLayer("k", ScalarMap(values, "N", "force")), parts)
    found = Message(parts.message({})).map(described)
    assert max(found.shape) == pictures.MAP_PX
    assert (described["low"], described["high"], described["unit"]) == (0.0, 2.5, "N")
    assert found.max() == 2.5


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_do_not_spoil_a_map(bad: float) -> None:
    values = np.ones(SHAPE, np.float32)
    values[0, 0] = bad
    parts = MessageParts()
    described = pictures.map_of(pictures.NamedLayer("k", ScalarMap(values)), parts)
    assert (described["low"], described["high"]) == (0.0, 1.0)


def test_a_field_of_vectors_has_arrows_where_it_is_measured() -> None:
    valid = np.zeros(SHAPE, np.bool_)
    valid[:, :32] = True
    field = DisplacementField(np.full((*SHAPE, 2), 0.3, np.float32), valid, 0.1)
    ((layer,), _) = pictures.layers_of([field])
    assert isinstance(layer.layer, VectorMap)
    parts = MessageParts()
    described = pictures.map_of(layer, parts)
    arrows = Message(parts.message({})).array(described["arrows"])
    assert len(arrows)
    assert (arrows[:, 0] < 32).all()
    np.testing.assert_allclose(arrows[:, 2:], 0.3)


def test_outlines_have_their_area_and_points_that_are_not_finite_are_left_out() -> None:
    mask = np.zeros(SHAPE, np.bool_)
    mask[10:20, 10:30] = True
    places = np.array([[1, 1], [np.nan, 2], [5, 6]], np.float32)
    layers = [
        pictures.NamedLayer("o", Outline(mask)),
        pictures.NamedLayer(
            "p", Points(places, "markers", places - 1, np.array([True, True, False]))
        ),
    ]
    parts = MessageParts()
    outline, points = pictures.overlays(layers, 0.1, parts)
    message = Message(parts.message({}))
    assert outline["area_mm2"] == pytest.approx(2.0)
    line = message.array(outline["lines"][0])
    assert (line.min(axis=0).tolist(), line.max(axis=0).tolist()) == ([10, 10], [29, 19])
    assert message.array(points["places"]).tolist() == [[1, 1, 0, 0], [5, 6, 4, 5]]
    assert message.array(points["reliable"]).tolist() == [1, 0]


def test_an_empty_contact_has_no_outline() -> None:
    mask = ContactMask(np.zeros(SHAPE, np.bool_), 0.1)
    layers, _ = pictures.layers_of([mask])
    (outline,) = pictures.overlays(layers, 0.1, MessageParts())
    assert outline["lines"] == []
