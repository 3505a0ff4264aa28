"""Height of the gel surface at the rim of a contact."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tactile_core.algorithms.contact import rim_share
from tactile_sim import VirtualStage


def test_on_a_half_space_the_rim_is_at_half_the_depth() -> None:
    assert rim_share(0.01, 2.0) == pytest.approx(1.0, abs=0.02)


def test_the_rim_is_lower_on_a_thinner_gel() -> None:
    shares = [rim_share(1.0, thickness_mm) for thickness_mm in (8.0, 4.0, 2.0, 1.0)]
    assert shares == sorted(shares, reverse=True)
    assert 0 < shares[-1] < 0.25


@pytest.mark.parametrize("thickness_mm", [1e-9, 1e-3, 0.1, 1e3, 1e9])
def test_the_rim_is_between_the_undeformed_surface_and_that_of_a_half_space(
    thickness_mm: float,
) -> None:
    assert 0 <= rim_share(1.0, thickness_mm) <= 1


def test_only_the_ratio_of_contact_radius_and_thickness_matters() -> None:
    assert rim_share(1.0, 2.0) == pytest.approx(rim_share(3.0, 6.0))


@pytest.mark.parametrize(("diameter_mm", "depth_mm"), [(4.0, 0.4), (8.0, 0.4)])
def test_the_mechanics_of_the_virtual_sensor_agree(diameter_mm: float, depth_mm: float) -> None:
    stage = VirtualStage("hex_fingertip", seed=0, mode="fast")
    stage.indenter("sphere", diameter_mm=diameter_mm)
    stage.press(depth_mm=depth_mm)
    truth, scale = stage.truth(), stage.profile.image.mm_per_px
    contact = truth.contact.astype(np.uint8)
    edge = contact - cv2.erode(contact, np.ones((3, 3), np.uint8)) > 0
    rim_mm, top_mm = truth.height_mm[edge].mean(), truth.height_mm.max()
    thickness_mm = stage.profile.gel.thickness_mm
    assert thickness_mm is not None
    share = rim_share(np.sqrt(contact.sum() / np.pi) * scale, thickness_mm)
    assert share == pytest.approx(rim_mm / (top_mm - rim_mm), abs=0.1)
