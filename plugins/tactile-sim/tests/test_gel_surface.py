"""The virtual gel surface: signs, ground truth, load control, and impossible moves."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from tactile_core import load_profile
from tactile_core.errors import InputError
from tactile_core.profiles.model import Profile
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter

BALL = make_indenter("sphere", diameter_mm=8.0)


def profile_with(**gel: Any) -> Profile:
    """Return the hexagonal fingertip with another gel."""
    profile = load_profile("hex_fingertip")
    return profile.model_copy(update={"gel": profile.gel.model_copy(update=gel)})


def pressed(profile: Profile | None = None, mode: Any = "fast", **load: Any) -> GelSurface:
    """Return a gel surface under a ball of 8 mm."""
    place = {key: load.pop(key) for key in ("x_mm", "y_mm") if key in load}
    surface = GelSurface(profile or load_profile("hex_fingertip"), mode)
    surface.indent_with(BALL, **place)
    surface.press(**(load or {"depth_mm": 0.4}))
    return surface


def test_undeformed_gel_is_flat_and_free() -> None:
    truth = GelSurface(load_profile("hex_fingertip"), "fast").truth()
    assert truth.height_mm.shape == (480, 640)
    assert not truth.height_mm.any()
    assert not truth.contact.any()
    assert not truth.wrench.any()


@pytest.mark.parametrize("size_mm", [None, (17.0, 12.6), (18.0, 14.0), (25.0, 25.0)])
def test_a_press_at_one_border_leaves_the_opposite_border_still(size_mm: Any) -> None:
    """Also where the view shows the gel's edges: periodic images must not touch each other."""
    surface = pressed(profile_with(size_mm=size_mm, thickness_mm=4.0), x_mm=-7.5, depth_mm=0.6)
    height_mm = surface.truth().height_mm
    assert height_mm.max() > 0.59
    assert np.abs(height_mm[:, -64:]).max() < 0.012


@pytest.mark.parametrize("mode", ["fast", "accurate"])
def test_gel_in_contact_has_the_objects_shape(mode: str) -> None:
    truth = pressed(mode=mode, x_mm=1.0, y_mm=-0.5).truth()
    x = (np.arange(640) - 319.5) * truth.mm_per_px - 1.0
    y = (np.arange(480)[:, None] - 239.5) * truth.mm_per_px + 0.5
    inside = np.hypot(x, y) < 0.8 * np.sqrt(truth.contact.sum() / np.pi) * truth.mm_per_px
    ball = 0.4 - (4 - np.sqrt(16 - np.minimum(x**2 + y**2, 16)))
    error = np.abs(truth.height_mm - ball)[inside].max()
    assert error < (0.001 if mode == "accurate" else 0.006)
    assert truth.contact[inside].all()


def test_gradients_are_those_of_the_height() -> None:
    truth = pressed(x_mm=2.0).truth()
    gy, gx = np.gradient(truth.height_mm.astype(float), truth.mm_per_px)
    inner = (slice(1, -1), slice(1, -1))
    np.testing.assert_allclose(truth.gradients[..., 0][inner], gx[inner], atol=5e-3)
    np.testing.assert_allclose(truth.gradients[..., 1][inner], gy[inner], atol=5e-3)


@pytest.mark.parametrize(("dx", "dy"), [(0.1, 0.0), (0.0, -0.1)])
def test_shear_force_is_along_the_displacement(dx: float, dy: float) -> None:
    surface = pressed()
    surface.shear(dx, dy)
    fx, fy, fz, _ = surface.wrench
    assert fz > 0.5
    np.testing.assert_allclose(
        np.array([fx, fy]) / np.hypot(fx, fy), [dx / 0.1, dy / 0.1], atol=0.01
    )
    middle = surface.truth().displacement_mm[240, 320]
    np.testing.assert_allclose(middle, [dx, dy], atol=0.01)


def test_rotation_from_x_towards_y_has_a_positive_moment() -> None:
    surface = pressed()
    surface.twist(3.0)
    assert surface.wrench[3] > 0.05


def test_moment_is_about_the_image_centre() -> None:
    surface = pressed(x_mm=2.0)
    surface.shear(dy_mm=0.1)
    assert surface.wrench[3] == pytest.approx(2.0 * surface.wrench[1], rel=0.05)


def test_markers_and_dense_field_have_the_same_displacement() -> None:
    surface = pressed()
    surface.shear(dx_mm=0.3, dy_mm=0.2, steps=4)
    rest = np.stack(np.meshgrid(np.arange(60, 600, 40.0), np.arange(60, 440, 40.0)), -1)
    rest = rest.reshape(-1, 2)
    now = surface.carried_px(rest)
    from scipy.ndimage import map_coordinates

    truth = surface.truth()
    dense = [
        map_coordinates(truth.displacement_mm[..., k], now[:, ::-1].T, order=1) for k in (0, 1)
    ]
    np.testing.assert_allclose((now - rest) * truth.mm_per_px, np.stack(dense, 1), atol=2e-3)


def test_a_given_force_is_reached_and_held() -> None:
    surface = pressed(force_n=1.5)
    assert surface.wrench[2] == pytest.approx(1.5, rel=1e-4)
    surface.shear(dx_mm=0.2, steps=2)
    assert surface.wrench[2] == pytest.approx(1.5, rel=1e-4)


def test_a_given_depth_is_held() -> None:
    surface = pressed(depth_mm=0.3)
    surface.shear(dx_mm=0.2, steps=2)
    assert surface.truth().depth_mm == pytest.approx(0.3)
    assert surface.state.displacement_mm[2].max() == pytest.approx(0.3, abs=0.01)


def test_integrated_displacement_is_proportional_to_the_force() -> None:
    surface = pressed(profile_with(size_mm=None, crown_mm=0.0))
    surface.shear(0.15, -0.1, steps=2)
    total = surface.state.displacement_mm[:2].sum((1, 2), dtype=float) * surface.grid.cell_mm2
    np.testing.assert_allclose(0.145 / 2.0 * total, surface.wrench[:2], rtol=1e-3, atol=1e-4)


def test_work_of_shearing_is_stored_or_spent_on_slip() -> None:
    surface = pressed(mode="accurate")
    cell = surface.grid.cell_mm2
    work = spent = 0.0

    def stored() -> float:
        u, q = (
            surface.state.displacement_mm.astype(float),
            surface.state.grip.traction.astype(float),
        )
        return 0.5 * cell * float((q * u[:2]).sum() + (surface.state.pressure_mpa * u[2]).sum())

    before = stored()
    for dx in (0.1, 0.1, 0.1, -0.1, -0.1, -0.1, -0.1, 0.1):
        old = surface.state
        surface.shear(dx_mm=dx)
        new = surface.state
        mean = (old.grip.traction.astype(float) + new.grip.traction) / 2
        press = (old.pressure_mpa.astype(float) + new.pressure_mpa) / 2
        slip = new.anchors_mm - old.anchors_mm - np.array([dx, 0.0])[:, None, None]
        work += cell * float(mean[0].sum()) * dx
        spent -= cell * float((mean * slip).sum())
        # a moving ball also indents the surface in front of it and unloads it behind
        work += cell * float((press * (new.displacement_mm[2] - old.displacement_mm[2])).sum())
    assert spent > 0
    assert work == pytest.approx(spent + stored() - before, abs=1e-3 * spent)


def test_work_over_a_closed_loop_is_positive() -> None:
    surface = pressed()
    work, force = 0.0, 0.0
    for dx in (0.1, 0.1, 0.1, -0.1, -0.1, -0.1):
        surface.shear(dx_mm=dx)
        work += (force + surface.wrench[0]) / 2 * dx
        force = surface.wrench[0]
    assert work > 0


def test_the_contact_moves_with_an_object_that_slides_far() -> None:
    surface = pressed(x_mm=-3.0, depth_mm=0.3)
    surface.shear(dx_mm=6.0, steps=60)
    fx, fy, fz, _ = surface.wrench
    assert fx == pytest.approx(0.5 * fz, rel=0.02)
    assert abs(fy) < 0.01 * fx
    truth = surface.truth()
    assert not truth.stick.any()
    centre = np.argwhere(truth.contact).mean(0)
    assert (centre[1] - 319.5) * truth.mm_per_px == pytest.approx(3.0, abs=0.15)
    assert centre[0] == pytest.approx(239.5, abs=2)


def test_traction_in_stick_is_below_its_limit() -> None:
    surface = pressed(profile_with(friction=0.4, friction_speed_mm_s=None))
    for _ in range(3):
        surface.shear(0.05, 0.02)
        state = surface.state
        held = np.hypot(*state.grip.traction) < (1 - 2e-3) * 0.4 * state.pressure_mpa
        assert 0.2 < held[state.contact].mean() < 0.9
        # the last node before the limit may be either
        assert np.count_nonzero(state.stick != (held & state.contact)) <= 2


def test_a_ball_that_rolls_shears_the_gel_little() -> None:
    rolled, shifted = pressed(), pressed()
    rolled.roll(dx_mm=0.6, steps=6)
    shifted.shear(dx_mm=0.6, steps=6)
    assert abs(rolled.wrench[0]) < 0.15 * shifted.wrench[0]
    assert rolled.truth().contact.sum() == pytest.approx(shifted.truth().contact.sum(), rel=0.05)


def test_a_released_gel_is_undeformed() -> None:
    surface = pressed()
    surface.shear(dx_mm=0.2)
    surface.release()
    assert not surface.truth().height_mm.any()
    assert not surface.wrench.any()
    assert not surface.pressed


def test_a_fast_release_leaves_an_indentation_that_decays() -> None:
    surface = GelSurface(load_profile("hex_fingertip"), "fast")
    surface.indent_with(BALL)
    surface.press(depth_mm=0.4, seconds=0.5)
    surface.hold(30.0)
    surface.release(seconds=0.1)
    left = surface.truth().height_mm.max()
    surface.hold(300.0)
    assert 0.02 < left < 0.2
    assert surface.truth().height_mm.max() < 0.01 * left
    assert surface.time_s == pytest.approx(330.6)


def test_a_dome_makes_contact_at_its_top_and_responds_like_a_ball() -> None:
    flat = GelSurface(profile_with(size_mm=None, crown_mm=0.0), "accurate")
    dome = GelSurface(
        profile_with(shape="dome", radius_mm=40.0, size_mm=None, crown_mm=0.0), "accurate"
    )
    flat.indent_with(make_indenter("sphere", diameter_mm=2 / (1 / 5 + 1 / 40)))
    dome.indent_with(make_indenter("sphere", diameter_mm=10.0))
    for surface in (flat, dome):
        surface.press(depth_mm=0.3)
    assert dome.wrench[2] == pytest.approx(flat.wrench[2], rel=0.01)
    assert dome.truth().height_mm.max() == pytest.approx(0.3, abs=0.002)


def test_first_contact_on_a_dome_is_on_its_slope() -> None:
    surface = GelSurface(
        profile_with(shape="dome", radius_mm=40.0, size_mm=None, crown_mm=0.0), "fast"
    )
    surface.indent_with(make_indenter("sphere", diameter_mm=10.0), x_mm=5.0)
    surface.press(depth_mm=0.2)
    centre = np.argwhere(surface.truth().contact)[:, 1].mean()
    # both slopes are equal where x / 40 = (5 − x) / 5
    assert (centre - 319.5) * surface.mm_per_px == pytest.approx(5.0 * 40 / 45, abs=0.1)


@pytest.mark.parametrize("depth", [0.06, 0.5])
def test_accurate_mode_has_ten_nodes_on_the_contact_radius(depth: float) -> None:
    surface = pressed(mode="accurate", depth_mm=depth)
    assert np.sqrt(surface.state.contact.sum() / np.pi) >= 10


def test_fast_mode_agrees_with_the_accurate_one() -> None:
    fast, accurate = pressed(), pressed(mode="accurate")
    for surface in (fast, accurate):
        surface.shear(dx_mm=0.24, steps=4)
    np.testing.assert_allclose(fast.wrench[:3], accurate.wrench[:3], rtol=0.03, atol=1e-3)
    rough, fine = fast.truth(), accurate.truth()
    assert np.abs(rough.height_mm - fine.height_mm).max() < 0.015
    assert np.abs(rough.displacement_mm - fine.displacement_mm).max() < 0.015


def test_motions_are_reproducible_and_survive_pickling() -> None:
    one, other = pressed(), pickle.loads(pickle.dumps(pressed()))
    for surface in (one, other):
        surface.shear(dx_mm=0.1)
        surface.hold(1.0)
    np.testing.assert_array_equal(one.truth().height_mm, other.truth().height_mm)
    np.testing.assert_array_equal(one.wrench, other.wrench)


def test_reset_restores_the_initial_state() -> None:
    surface = pressed()
    surface.hold(1.0)
    surface.reset()
    assert surface.time_s == 0
    assert not surface.truth().height_mm.any()
    surface.press(depth_mm=0.4)
    np.testing.assert_array_equal(surface.wrench, pressed().wrench)


@pytest.mark.parametrize("name", ["baxter_fingertip", "desktop_six_led", "desktop_three_colour"])
def test_every_shipped_profile_has_a_virtual_gel(name: str) -> None:
    surface = GelSurface(load_profile(name), "fast")
    surface.indent_with(make_indenter("sphere", diameter_mm=4.0))
    surface.press(depth_mm=0.3)
    assert surface.wrench[2] > 0.1
    assert surface.truth().height_mm.max() == pytest.approx(0.3, abs=0.06)


@pytest.mark.parametrize(
    ("attempt", "message"),
    [
        (lambda surface: surface.press(depth_mm=2.5), "2.5 mm deep into a gel that is 2 mm thick"),
        (lambda surface: surface.press(force_n=1000.0), "into a gel that is 2 mm thick"),
        (lambda surface: surface.press(depth_mm=-0.1), "should be 0 or more, not -0.1"),
        (lambda surface: surface.press(force_n=0.0), "release"),
        (lambda surface: surface.press(), "either depth_mm or force_n"),
        (lambda surface: surface.press(0.1, 1.0), "either depth_mm or force_n"),
        (lambda surface: surface.shear(dx_mm=0.1, steps=-1), "1 or more, not -1"),
        (lambda surface: surface.shear(dx_mm=0.1, steps=0), "1 or more, not 0"),
        (lambda surface: surface.shear(dx_mm=float("nan")), "finite"),
        (lambda surface: surface.twist(1.0, seconds=-1.0), "seconds should be 0 or more"),
        (lambda surface: surface.hold(-1.0), "seconds should be 0 or more"),
        (lambda surface: surface.indent_with(BALL), "release it"),
    ],
)
def test_an_impossible_move_is_refused_and_changes_nothing(attempt: Any, message: str) -> None:
    surface = pressed()
    before = surface.truth().height_mm
    with pytest.raises(InputError, match=message) as caught:
        attempt(surface)
    assert "\n" not in str(caught.value)
    np.testing.assert_array_equal(surface.truth().height_mm, before)
    assert surface.pressed


def test_moves_before_a_press_are_refused() -> None:
    surface = GelSurface(load_profile("hex_fingertip"), "fast")
    with pytest.raises(InputError, match="choose an indenter first"):
        surface.press(depth_mm=0.1)
    surface.indent_with(BALL)
    with pytest.raises(InputError, match="press an object before"):
        surface.shear(dx_mm=0.1)
    with pytest.raises(InputError, match="outside the gel"):
        surface.indent_with(BALL, x_mm=50.0)
    with pytest.raises(InputError, match="'accurate' or 'fast'"):
        GelSurface(load_profile("hex_fingertip"), "quick")  # type: ignore[arg-type]


def test_only_round_objects_roll() -> None:
    surface = GelSurface(load_profile("hex_fingertip"), "fast")
    surface.indent_with(make_indenter("cylinder", diameter_mm=20.0))
    surface.press(depth_mm=0.2)
    surface.roll(dy_mm=0.1)
    with pytest.raises(InputError, match="across its axis"):
        surface.roll(dx_mm=0.1)
    surface.release()
    surface.indent_with(make_indenter("flat", diameter_mm=5.0))
    surface.press(depth_mm=0.2)
    with pytest.raises(InputError, match="cannot roll"):
        surface.roll(dx_mm=0.1)
