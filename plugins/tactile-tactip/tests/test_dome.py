"""The virtual dome moves its pins as geometry demands."""

import numpy as np
import pytest

from tactile_core.profiles.loader import load_profile
from tactile_tactip.dome import Plate, picture, pins_at_rest, pressed_pins, seen_px

IMAGE = load_profile("tactip").image
REST = pins_at_rest()


def test_there_are_as_many_pins_as_the_profile_says_in_a_hexagon() -> None:
    markers = load_profile("tactip").gel.markers
    assert len(REST) == 127 == markers.count
    turned = REST[:, :2] @ np.array([[0.5, np.sqrt(0.75)], [-np.sqrt(0.75), 0.5]])
    apart = np.hypot(*(turned[:, None] - REST[None, :, :2]).transpose(2, 0, 1))
    assert apart.min(axis=1).max() < 1e-9


def test_the_pins_are_on_a_sphere() -> None:
    assert np.hypot(np.hypot(*REST[:, :2].T), REST[:, 2] + 20) == pytest.approx(20)


def test_a_plate_that_does_not_touch_moves_nothing() -> None:
    assert pressed_pins(Plate()) == pytest.approx(REST, abs=1e-3)


def test_a_deeper_plate_moves_every_pin_further_towards_the_camera() -> None:
    shallow, deep = (pressed_pins(Plate(depth_mm))[:, 2] for depth_mm in (1.0, 2.0))
    assert (deep < shallow).all()
    assert (shallow < REST[:, 2]).all()


def test_no_pin_is_beyond_the_plate() -> None:
    for angle_deg in (-20, 0, 20):
        angle = np.deg2rad(angle_deg)
        normal = np.array([np.sin(angle), 0, np.cos(angle)])
        plane = 20 * (1 - normal[2]) - 2.0
        assert (REST @ normal - plane).max() > 1.5  # some are, before the press
        pushed = pressed_pins(Plate(2.0, angle_deg))
        # bulging to the side of an inclined plate leads beyond it by a little
        assert (pushed @ normal - plane).max() < 0.3


def test_the_opposite_angle_is_the_mirror_image() -> None:
    one = pressed_pins(Plate(2.0, 15.0))
    other = pressed_pins(Plate(2.0, -15.0))
    mirrored = one * [-1, 1, 1]
    apart = np.linalg.norm(mirrored[:, None] - other[None], axis=2)
    assert apart.min(axis=1).max() < 1e-9


def test_shear_moves_the_pins_in_contact_with_the_plate() -> None:
    moved = pressed_pins(Plate(3.0, 0.0, (1.0, 0.0))) - pressed_pins(Plate(3.0))
    middle = np.hypot(*REST[:, :2].T) < 3
    assert moved[middle, 0].min() > 0.8
    assert moved[:, 0].max() <= 1
    assert not moved[:, 1:].any()
    edge = np.hypot(*REST[:, :2].T) > 13
    assert moved[edge, 0].max() < 0.5


def test_the_tip_is_in_the_middle_of_the_image_at_the_scale_of_the_profile() -> None:
    at = seen_px(np.array([[0.0, 0, 0], [1, 0, 0]]), IMAGE)
    assert at[0] == pytest.approx([127.5, 127.5])
    assert at[1, 0] - at[0, 0] == pytest.approx(1 / IMAGE.mm_per_px)


def test_the_same_numbers_give_the_same_picture_and_others_other_noise() -> None:
    one, same, other, unit = (
        picture(REST, IMAGE, number=number, seed=seed)
        for number, seed in ((1, 0), (1, 0), (2, 0), (1, 1))
    )
    assert (one == same).all()
    assert (one != other).mean() > 0.5
    assert (one != unit).mean() > 0.5
