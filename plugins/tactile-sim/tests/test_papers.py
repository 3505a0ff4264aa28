"""Observations of Yuan et al. (ICRA 2015, Sensors 2017), reproduced on the shipped virtual gel."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core import load_profile
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.truth import TrueState

STEP_MM = 0.05
PRESSES = {
    # a plate larger than the gel, "in full contact with the sensor"
    "flat": (make_indenter("flat", size_mm=(40.0, 40.0)), 0.0, 45.0),
    # moved along its axis, like a can that is lifted
    "cylinder": (make_indenter("cylinder", diameter_mm=38.08), 90.0, 18.0),
    "ball": (make_indenter("sphere", diameter_mm=25.0), 0.0, 6.0),
}


@dataclass(frozen=True)
class Sheared:
    """An object pressed and then sheared along y in steps; displacements since the press.

    Attributes
    ----------
    moved_mm, force_n, whole_mm, visible_mm, largest_mm, entropy_bits, stick_share : (N,)
        Of each step: of the object, shear force, mean displacement over the whole contact and over
        its visible part, largest displacement, its entropy, and how much of the visible contact
        sticks.
    stick, contact : list of (H, W) bool
    """

    moved_mm: NDArray[np.float64]
    force_n: NDArray[np.float64]
    whole_mm: NDArray[np.float64]
    visible_mm: NDArray[np.float64]
    largest_mm: NDArray[np.float64]
    entropy_bits: NDArray[np.float64]
    stick_share: NDArray[np.float64]
    stick: list[NDArray[np.bool_]]
    contact: list[NDArray[np.bool_]]

    def at(self, moved_mm: float) -> int:
        """Index of the step at which the object has moved this far."""
        return int(np.argmin(np.abs(self.moved_mm - moved_mm)))


def _pressed(kind: str) -> GelSurface:
    indenter, angle_deg, force_n = PRESSES[kind]
    surface = GelSurface(load_profile("hex_fingertip"), "fast")
    surface.indent_with(indenter, angle_deg=angle_deg)
    surface.press(force_n=force_n)
    return surface


def _entropy_bits(displacement_mm: NDArray[np.float64]) -> float:
    counts = np.bincount((displacement_mm * 256).astype(int))
    share = counts[counts > 0] / counts.sum()
    return float(-(share * np.log2(share)).sum())


@pytest.fixture(scope="module", params=list(PRESSES))
def sheared(request: pytest.FixtureRequest) -> Sheared:
    return _shear(request.param)


@pytest.fixture(scope="module")
def plate() -> Sheared:
    return _shear("flat")


@pytest.fixture(scope="module")
def can() -> Sheared:
    return _shear("cylinder")


@cache
def _shear(kind: str) -> Sheared:
    surface = _pressed(kind)
    before, nodes_before = surface.truth(), surface.state.displacement_mm[:2]
    rows, sticks, contacts = [], [], []
    for moved in STEP_MM * np.arange(1, 17):
        surface.shear(dy_mm=STEP_MM)
        truth = surface.truth()
        since = truth.displacement_mm - before.displacement_mm
        size = np.hypot(*since[truth.contact].T)
        whole = (surface.state.displacement_mm[1] - nodes_before[1])[surface.state.contact].mean()
        rows.append(
            (
                moved,
                truth.wrench[1],
                whole,
                since[truth.contact][:, 1].mean(),
                size.max(),
                _entropy_bits(size),
                truth.stick.sum() / truth.contact.sum(),
            )
        )
        sticks.append(truth.stick)
        contacts.append(truth.contact)
    return Sheared(*np.array(rows).T, sticks, contacts)


def _r2_of_proportion(force: NDArray[np.float64], mean: NDArray[np.float64]) -> float:
    slope = (force * mean).sum() / (mean**2).sum()
    return float(1 - ((force - slope * mean) ** 2).sum() / ((force - force.mean()) ** 2).sum())


def test_shear_force_of_a_flat_indenter_is_linear_to_a_fifth_of_a_millimetre(
    plate: Sheared,
) -> None:
    early = plate.moved_mm < 0.21
    stiffness = plate.force_n[0] / plate.moved_mm[0]
    np.testing.assert_allclose(plate.force_n[early], stiffness * plate.moved_mm[early], rtol=0.02)


def test_shear_force_then_saturates(plate: Sheared) -> None:
    stiffness = np.diff(plate.force_n) / STEP_MM
    middle, late = plate.at(0.5), plate.at(0.75)
    assert 0.2 * stiffness[0] < stiffness[middle] < 0.8 * stiffness[0]
    assert abs(stiffness[late - 1]) < 0.02 * stiffness[0]


def test_a_flat_indenter_slips_partially_at_0_5_mm_and_fully_at_0_7_mm(
    plate: Sheared,
) -> None:
    assert plate.stick_share[plate.at(0.2)] == 1
    assert 0.5 < plate.stick_share[plate.at(0.5)] < 0.95
    assert 0.02 < plate.stick_share[plate.at(0.6)] < 0.6
    assert plate.stick_share[plate.at(0.7)] < 0.01


def test_mean_displacement_of_the_whole_contact_is_proportional_to_the_force(
    plate: Sheared,
) -> None:
    assert _r2_of_proportion(plate.force_n, plate.whole_mm) > 0.999


def test_mean_displacement_of_the_visible_contact_is_nearly_proportional_to_the_force(
    sheared: Sheared,
) -> None:
    assert _r2_of_proportion(sheared.force_n, sheared.visible_mm) > 0.99


def test_largest_displacement_follows_the_object_to_0_6_mm_and_then_stays_or_falls(
    plate: Sheared,
) -> None:
    early = plate.moved_mm < 0.61
    np.testing.assert_allclose(plate.largest_mm[early], plate.moved_mm[early], rtol=0.02)
    late = plate.largest_mm[plate.at(0.7) :]
    assert late.max() < 0.66
    assert late[-1] <= late[0]


def test_partial_slip_starts_at_the_border_and_moves_inwards(can: Sheared) -> None:
    for earlier, later, contact in zip(can.stick, can.stick[1:], can.contact, strict=False):
        # the slip region surrounds the stick region and only grows
        assert (later & ~earlier).sum() <= 0.02 * contact.sum()
    half = can.at(0.5)
    inside = _distance_to_border(can.contact[half])
    slips = can.contact[half] & ~can.stick[half]
    assert inside[can.stick[half]].mean() > 2 * inside[slips].mean()


def _distance_to_border(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    from scipy.ndimage import distance_transform_edt

    # the border of the view is not a border of the contact
    return np.asarray(distance_transform_edt(np.pad(mask, 1, mode="edge"))[1:-1, 1:-1])


def test_a_cylinder_slips_earlier_and_over_a_wider_range_than_a_plate(
    plate: Sheared, can: Sheared
) -> None:
    def band(of: Sheared) -> tuple[float, float]:
        partly = of.moved_mm[(of.stick_share < 0.95) & (of.stick_share > 0.02)]
        return float(partly.min()), float(np.ptp(partly))

    (first, width), (plate_first, plate_width) = band(can), band(plate)
    assert first < plate_first - 0.2
    assert width > plate_width + 0.2


def test_entropy_rises_with_partial_slip_into_the_incipient_band_of_a_plate(
    plate: Sheared,
) -> None:
    assert plate.entropy_bits[plate.at(0.3)] < 1.5
    assert plate.entropy_bits[plate.at(0.5)] < 4.5
    assert 4.5 < plate.entropy_bits[plate.at(0.6)] < 6.0
    assert 4.5 < plate.entropy_bits[plate.at(0.65)] < 6.0


def test_entropy_of_a_cylinder_is_4_to_6_5_in_partial_slip(can: Sheared) -> None:
    partial = (can.stick_share < 0.4) & (can.stick_share > 0.1)
    assert partial.any()
    assert (can.entropy_bits[partial] > 4.0).all()
    assert (can.entropy_bits[partial] < 6.5).all()


@pytest.fixture(scope="module")
def turned() -> dict[float, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """For each angle of the plate: rotation of the gel surface, and distance from the middle."""
    surface = _pressed("flat")
    before = surface.truth().displacement_mm
    found = {}
    for angle in (0.6, 1.5, 3.0, 4.5):
        surface.twist(angle - surface.state.pose.angle_deg, steps=3)
        since = surface.truth().displacement_mm - before
        height, width = since.shape[:2]
        x = (np.arange(width) - (width - 1) / 2) * surface.mm_per_px
        y = (np.arange(height)[:, None] - (height - 1) / 2) * surface.mm_per_px
        r = np.hypot(x, y)
        # fields refer to current positions, so the rotation is computed from there
        angles = np.degrees((x * since[..., 1] - y * since[..., 0]) / np.maximum(r, 0.1) ** 2)
        found[angle] = angles, r
    return found


def test_a_twist_of_0_6_degrees_is_homogeneous(
    turned: dict[float, tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> None:
    angles, r = turned[0.6]
    np.testing.assert_allclose(angles[r > 1], 0.6, rtol=0.02)


def test_at_4_5_degrees_the_outer_markers_rotate_less(
    turned: dict[float, tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> None:
    angles, r = turned[4.5]
    assert angles[(r > 1) & (r < 3)].mean() == pytest.approx(4.5, rel=0.02)
    assert angles[r > 8].mean() < 3.8


def _step_in_shear(before_mm: float, step_mm: float) -> tuple[list[float], list[TrueState]]:
    """Forces before, directly after, 10 s, 3 min and 10 min after a step, and ground truths."""
    surface = _pressed("flat")
    surface.shear(dy_mm=before_mm, steps=8)
    forces, truths = [surface.wrench[1]], [surface.truth()]
    surface.shear(dy_mm=step_mm, steps=4, seconds=0.4)
    for seconds in (0.0, 10.0, 170.0, 420.0):
        surface.hold(seconds)
        forces.append(surface.wrench[1])
        truths.append(surface.truth())
    return forces, truths


def test_after_a_step_the_border_slips_back_while_the_centre_stays() -> None:
    forces, truths = _step_in_shear(0.45, 0.1)
    moves = [
        (later.displacement_mm - earlier.displacement_mm)[..., 1]
        for earlier, later in itertools.pairwise(truths)
    ]
    jump, back, slow, _ = moves
    centre = tuple(n // 2 for n in jump.shape)
    assert jump.mean() > 0.09
    assert jump.std() < 0.15 * jump.mean()
    assert back[centre] == pytest.approx(0, abs=0.003)
    assert back.min() < -0.04
    assert np.abs(slow).max() < 0.1 * np.abs(back).max()
    assert forces[1] - forces[2] > 5 * (forces[2] - forces[3]) > 0


def test_relaxation_after_a_step_takes_three_minutes() -> None:
    forces, _ = _step_in_shear(0.45, 0.1)
    assert forces[3] == pytest.approx(forces[4], rel=0.005)


def test_a_small_step_causes_no_slip() -> None:
    _, truths = _step_in_shear(0.15, 0.05)
    since = (truths[-1].displacement_mm - truths[0].displacement_mm)[..., 1]
    np.testing.assert_allclose(since, 0.05, atol=0.002)


def test_a_large_step_ends_near_the_force_before_it() -> None:
    forces, _ = _step_in_shear(0.6, 0.5)
    assert forces[1] > 1.5 * forces[0]
    assert forces[3] == pytest.approx(forces[0], rel=0.03)


@pytest.mark.parametrize("kind", ["flat", "cylinder", "ball"])
def test_markers_spread_outwards_under_a_normal_load(kind: str) -> None:
    small = make_indenter("flat", diameter_mm=12.5) if kind == "flat" else PRESSES[kind][0]
    surface = GelSurface(load_profile("hex_fingertip"), "fast")
    surface.indent_with(small)
    surface.press(force_n=4.0)
    x, y = np.meshgrid(np.arange(-6, 6.1, 1.2), np.arange(-4.8, 4.9, 1.2))
    markers = np.stack([x.ravel(), y.ravel()], 1)
    moved = surface.carry_points(markers) - markers
    outwards = (moved * markers).sum(1)
    far = np.hypot(*moved.T) > 0.3 * np.hypot(*moved.T).max()
    assert (outwards[far] > 0).all()
    np.testing.assert_allclose(moved.mean(0), 0, atol=1e-3)


def test_force_is_linear_in_depth_and_differs_between_loading_and_unloading() -> None:
    surface = GelSurface(load_profile("hex_fingertip"), "fast")
    surface.indent_with(make_indenter("flat", diameter_mm=12.5))
    depths = np.linspace(0.02, 0.2, 10)
    loading, unloading = [], []
    for depth in depths:
        surface.press(depth_mm=depth, steps=1, seconds=0.5)
        loading.append(surface.wrench[2])
    for depth in depths[::-1]:
        surface.press(depth_mm=depth, steps=1, seconds=0.5)
        unloading.append(surface.wrench[2])
    assert np.corrcoef(depths, loading)[0, 1] ** 2 > 0.99
    assert np.mean(unloading[::-1]) < 0.97 * np.mean(loading)
