"""Outlines and heights of a contact do not show the nodes of the mechanics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from experiments.contact_outline import hausdorff_px, nodes_only
from tactile_core import load_profile
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.modes import Mode

PROFILE = load_profile("hex_fingertip", sim=True)
OBJECTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("sphere", {"diameter_mm": 6.0}),
    ("cone", {"half_angle_deg": 65.0}),
    ("flat", {"diameter_mm": 4.0}),
)


def pressed(kind: str, options: dict[str, Any], mode: Mode) -> GelSurface:
    surface = GelSurface(PROFILE, mode)
    surface.indent_with(make_indenter(kind, **options), x_mm=0.53, y_mm=-0.31)
    surface.press(depth_mm=0.3)
    return surface


@pytest.mark.parametrize(("kind", "options"), OBJECTS)
def test_fast_outlines_are_within_a_pixel_and_a_half_of_accurate_ones(
    kind: str, options: dict[str, Any]
) -> None:
    fast, accurate = (pressed(kind, options, mode).truth() for mode in ("fast", "accurate"))
    assert hausdorff_px(fast.contact, accurate.contact) <= 1.5
    assert hausdorff_px(nodes_only(fast), accurate.contact) > 2.5


def test_the_outline_of_a_ball_is_round() -> None:
    contact = pressed("sphere", {"diameter_mm": 6.0}, "fast").truth().contact
    rows, columns = np.nonzero(contact)
    radius = np.sqrt(contact.sum() / np.pi)
    farthest = np.hypot(rows - rows.mean(), columns - columns.mean()).max()
    assert farthest == pytest.approx(radius, abs=1.0)


@pytest.mark.parametrize(("kind", "options"), OBJECTS)
def test_the_gel_does_not_penetrate_the_object(kind: str, options: dict[str, Any]) -> None:
    surface = pressed(kind, options, "fast")
    truth = surface.truth()
    y, x = ((np.arange(n) - (n - 1) / 2) * truth.mm_per_px for n in surface.image_shape)
    gap = make_indenter(kind, **options).gap_mm(x - 0.53, y[:, None] + 0.31)
    object_mm = surface.state.depth_mm - surface.state.level_mm - gap
    here = truth.contact
    rest = surface.gel.rest_mm(*np.meshgrid(x, y))
    assert (truth.height_mm - object_mm - rest)[here].min() > -1e-4
    assert truth.height_mm.max() == pytest.approx(0.3, rel=0.07)


def test_a_contact_that_sticks_everywhere_sticks_up_to_its_outline() -> None:
    surface = GelSurface(load_profile("hex_fingertip", overrides={"gel": {"friction": 50}}), "fast")
    surface.indent_with(make_indenter("sphere", diameter_mm=6.0))
    surface.press(depth_mm=0.3)
    surface.shear(dx_mm=0.02)
    truth = surface.truth()
    assert truth.stick.sum() > 0.98 * truth.contact.sum()


def test_nothing_is_in_contact_after_release() -> None:
    surface = pressed("sphere", {"diameter_mm": 6.0}, "fast")
    surface.release(seconds=0.1)
    truth = surface.truth()
    assert not truth.contact.any()
    assert not truth.stick.any()
    assert truth.height_mm.max() > 0
