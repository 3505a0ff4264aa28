"""Dense displacement fields of analytic deformations, and their decomposition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.displacement.decomposition import curl, decompose_field, divergence
from tactile_core.algorithms.displacement.marked_surface import MarkedSurface
from tactile_core.errors import InputError

SHAPE, SCALE_MM = (120, 160), 0.1
PITCH_PX = 11
X, Y = np.meshgrid(np.arange(SHAPE[1]), np.arange(SHAPE[0]))
MARKERS = np.stack(np.meshgrid(np.arange(5, 160, PITCH_PX), np.arange(5, 120, PITCH_PX)), -1)
MARKERS = MARKERS.reshape(-1, 2).astype(np.float64)
ALL = np.ones(len(MARKERS), np.bool_)
Array = NDArray[np.float64]

shifts = st.floats(-1.5, 1.5)
turns = st.floats(-20, 20)
growths = st.floats(-0.2, 0.2)


def similar(shift: Array, degrees: float, growth: float, centre_px: Array) -> Array:
    """(H, W, 2) field of a shift, rotation and expansion about a present point."""
    at = SCALE_MM * ((X - centre_px[0]) + 1j * (Y - centre_px[1]))
    was = at * np.exp(-1j * np.radians(degrees)) / (1 + growth) - complex(*shift)
    return np.stack([(at - was).real, (at - was).imag], -1)


def surface() -> MarkedSurface:
    return MarkedSurface(MARKERS, SHAPE, mm_per_px=SCALE_MM)


@given(shifts, shifts, turns, growths)
def test_a_similarity_is_decomposed_exactly(
    x: float, y: float, degrees: float, growth: float
) -> None:
    mask = np.hypot(X - 70, Y - 50) < 30
    centre = np.array([70.0, 50.0])
    field = similar(np.array([x, y]), degrees, growth, centre)
    found = decompose_field(field, mask, mm_per_px=SCALE_MM)
    np.testing.assert_allclose(found.shear_mm, [x, y], atol=1e-9)
    assert found.rotation_deg == pytest.approx(degrees, abs=1e-9)
    assert found.spread == pytest.approx(growth, abs=1e-9)
    np.testing.assert_allclose(found.centre_px, centre, atol=1e-9)
    assert found.residual_mm < 1e-9
    parts = found.shear_field(SHAPE) + found.torsion_field(SHAPE) + found.spread_field(SHAPE)
    np.testing.assert_allclose(parts, field, atol=1e-5)


@given(st.floats(20, 140), st.floats(20, 100), turns)
def test_the_shear_about_another_centre_is_that_of_the_gel_there(
    x: float, y: float, degrees: float
) -> None:
    field = similar(np.array([0.3, -0.1]), degrees, 0.02, np.array([x, y]))
    found = decompose_field(field, mm_per_px=SCALE_MM, centre_px=np.array([x, y]))
    np.testing.assert_allclose(found.shear_mm, [0.3, -0.1], atol=1e-9)
    assert found.rotation_deg == pytest.approx(degrees, abs=1e-9)


def test_an_empty_contact_has_no_shear_rotation_or_spread() -> None:
    found = decompose_field(np.ones((*SHAPE, 2)), np.zeros(SHAPE, np.bool_), mm_per_px=SCALE_MM)
    assert (found.shear_mm == 0).all()
    assert found.rotation_deg == found.spread == 0


def test_a_single_pixel_has_neither_rotation_nor_spread() -> None:
    mask = np.zeros(SHAPE, np.bool_)
    mask[30, 40] = True
    found = decompose_field(np.ones((*SHAPE, 2)), mask, mm_per_px=SCALE_MM)
    assert found.rotation_deg == found.spread == 0
    np.testing.assert_allclose(found.shear_mm, [1, 1])


@given(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))
def test_divergence_and_curl_of_a_linear_field_are_exact(
    xx: float, xy: float, yx: float, yy: float
) -> None:
    field = SCALE_MM * np.stack([xx * X + xy * Y, yx * X + yy * Y], -1)
    np.testing.assert_allclose(divergence(field, mm_per_px=SCALE_MM), xx + yy, atol=1e-4)
    np.testing.assert_allclose(curl(field, mm_per_px=SCALE_MM), yx - xy, atol=1e-4)


def test_the_curl_of_a_rotation_is_twice_its_angle() -> None:
    field = similar(np.zeros(2), 0.1, 0.0, np.array([80.0, 60.0]))
    np.testing.assert_allclose(curl(field, mm_per_px=SCALE_MM), 2 * np.radians(0.1), rtol=1e-2)
    np.testing.assert_allclose(divergence(field, mm_per_px=SCALE_MM), 0, atol=1e-4)


@pytest.mark.parametrize("shape", [(5, 5), (5, 5, 3), (1, 5, 2)])
def test_an_array_that_is_not_a_field_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=r"is \(H, W, 2\)"):
        divergence(np.zeros(shape), mm_per_px=SCALE_MM)


def test_a_mask_of_another_size_is_refused() -> None:
    with pytest.raises(InputError, match="must agree"):
        decompose_field(np.zeros((5, 5, 2)), np.ones((4, 5), np.bool_), mm_per_px=SCALE_MM)


@given(shifts, shifts)
def test_a_uniform_shift_is_reproduced_everywhere(x: float, y: float) -> None:
    found = surface().displacement(MARKERS + np.array([x, y]) / SCALE_MM, ALL)
    np.testing.assert_allclose(found, np.broadcast_to([x, y], found.shape), atol=2e-3)


def test_the_field_refers_to_present_positions() -> None:
    centre = np.array([80.0, 60.0])
    now = centre + (MARKERS - centre) @ np.array([[0.0, 1.0], [-1.0, 0.0]]).T * np.sin(0.15)
    now += (MARKERS - centre) * np.cos(0.15)
    found = surface().displacement(now, ALL)
    truth = similar(np.zeros(2), -np.degrees(0.15), 0.0, centre)
    inside = np.hypot(X - 80, Y - 60) < 50
    np.testing.assert_allclose(found[inside], truth[inside], atol=0.01)


def _bump() -> Array:
    size = np.exp(-((MARKERS - [80, 60]) ** 2).sum(1) / (2 * 25**2))
    return size[:, None] * np.array([0.5, 0.2])


@given(st.integers(0, 2**31))
def test_unseen_markers_are_ignored(seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = rng.random(len(MARKERS)) > 0.3
    now = MARKERS + _bump() / SCALE_MM
    elsewhere = np.where(seen[:, None], now, now + rng.normal(0, 50, now.shape))
    ours = surface()
    contact = np.hypot(X - 80, Y - 60) < 20
    np.testing.assert_array_equal(
        ours.displacement(now, seen, contact), ours.displacement(elsewhere, seen, contact)
    )


def test_unseen_markers_give_the_same_field_as_absent_ones() -> None:
    rng = np.random.default_rng(1)
    seen = rng.random(len(MARKERS)) > 0.2
    now = MARKERS + _bump() / SCALE_MM
    alone = MarkedSurface(MARKERS[seen], SHAPE, mm_per_px=SCALE_MM)
    np.testing.assert_allclose(
        surface().displacement(now, seen),
        alone.displacement(now[seen], ALL[seen]),
        atol=1e-3,
    )


@pytest.mark.parametrize("left", [0, 1, 2])
def test_few_markers_give_a_finite_field(left: int) -> None:
    now, seen = MARKERS + np.array([3, 0]), np.arange(len(MARKERS)) < left
    for markers, visible in ((MARKERS, seen), (MARKERS[:left], ALL[:left])):
        ours = MarkedSurface(markers, SHAPE, mm_per_px=SCALE_MM)
        found = ours.displacement(now[: len(markers)], visible, np.hypot(X - 9, Y - 9) < 20)
        assert np.isfinite(found).all()
        np.testing.assert_allclose(found[5, 8], [0.3 * min(left, 1), 0], atol=0.01)


def test_the_field_is_supported_near_seen_markers_only() -> None:
    seen = MARKERS[:, 0] < 60
    valid = surface().find_valid_area(MARKERS, seen)
    assert valid[:, :52].all()
    assert not valid[:, 75:].any()


def test_a_known_contact_makes_the_field_bend_at_its_border() -> None:
    """A disc moves by 0.3 mm between markers whose pitch is its diameter."""
    from tactile_core.algorithms.displacement.contact_shear import ElasticShear
    from tactile_core.algorithms.displacement.kriging import CoarseGrid
    from tactile_core.algorithms.force.elastic_layer import Elastomer

    contact = np.hypot(X - 76, Y - 63) < 16
    grid = CoarseGrid(SHAPE, SHAPE)
    shear = ElasticShear(grid, mm_per_px=SCALE_MM, elastomer=Elastomer(2.0, 1.0, 0.48))
    fields = shear.fields(contact.astype(np.float32))
    assert fields is not None
    along_x = fields.total(np.array([1.0, 0.0, 0.0, 0.0])).transpose(1, 2, 0)
    truth = 0.3 * along_x / along_x[contact, 0].mean()
    markers = MARKERS[::2]
    now = markers.copy()
    for _ in range(20):
        now = markers + _at(truth, now) / SCALE_MM
    ours = MarkedSurface(markers, SHAPE, mm_per_px=SCALE_MM)
    seen = ALL[::2]
    without, with_contact = (
        np.sqrt(np.mean((ours.displacement(now, seen, mask) - truth) ** 2))
        for mask in (None, contact)
    )
    assert with_contact < 0.5 * without


def test_torsion_and_expansion_are_those_of_tractions_that_grow_with_the_distance() -> None:
    from tactile_core.algorithms.displacement.contact_shear import ElasticFields, LayerResponse
    from tactile_core.algorithms.force.elastic_layer import Elastomer

    rows, columns, side_mm = 60, 80, 0.2
    everywhere = slice(0, rows), slice(0, columns)
    gel = Elastomer(1.0, 1.0, 0.48)
    layer = LayerResponse((rows, columns), everywhere, cell_mm=(side_mm, side_mm), elastomer=gel)
    x, y = (side_mm * (np.arange(n) - n / 3).astype(np.float32) for n in (columns, rows))
    one = np.exp(-((x - 1) ** 2) - ((y[:, None] + 0.5) ** 2) / 2).astype(np.float32)
    uniform, by_x, by_y = (layer.apply_traction(t) for t in (one, one * x, one * y[:, None]))
    (xx_x, yy_x, *_, xy_x, _, _), (xx_y, yy_y, *_, xy_y, _, _) = by_x, by_y
    fields = ElasticFields(uniform, x, y)
    torsion, expansion = (fields.total(strength) for strength in np.eye(4)[2:])
    for found, expected in (
        (torsion, [xy_x - xx_y, yy_x - xy_y]),
        (expansion, [xx_x + xy_y, xy_x + yy_y]),
    ):
        # elsewhere the nearest of the periodic tractions is another one
        here, there = (np.asarray(each)[:, 5:35, 10:55] for each in (found, expected))
        np.testing.assert_allclose(here, there, atol=2e-3 * np.abs(there).max())


@pytest.mark.parametrize("shape", [SHAPE, (121, 160), (120, 150)])
def test_the_share_of_each_cell_is_that_of_its_pixels(shape: tuple[int, int]) -> None:
    from tactile_core.algorithms.displacement.kriging import CoarseGrid

    mask = np.random.default_rng(0).random(shape) > 0.4
    share = CoarseGrid((12, 16), shape).share(mask)
    if shape == SHAPE:
        blocks = mask.reshape(12, 10, 16, 10).mean(axis=(1, 3))
        np.testing.assert_allclose(share, blocks, atol=1e-6)
    assert share.mean() == pytest.approx(mask.mean(), abs=0.01)


def test_a_field_that_stays_valid_is_the_same_array() -> None:
    ours = surface()
    valid = ours.find_valid_area(MARKERS, ALL)
    assert ours.find_valid_area(MARKERS + 0.1, ALL) is valid
    assert not valid.flags.writeable
    seen = MARKERS[:, 0] < 60
    assert not ours.find_valid_area(MARKERS, seen).all()
    assert ours.find_valid_area(MARKERS, ALL).all()


def _at(field: NDArray[np.float32], points: Array) -> Array:
    import cv2

    found = cv2.remap(field, points[:, None].astype(np.float32), np.empty(0), cv2.INTER_LINEAR)
    return np.asarray(found, np.float64)[:, 0]


def test_markers_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(InputError, match=r"\(N, 2\)"):
        MarkedSurface(np.zeros(4), SHAPE, mm_per_px=SCALE_MM)


@given(st.integers(0, 1000))
def test_errors_of_a_smooth_field_are_about_a_standard_deviation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cycles, phases = rng.uniform(0.5, 1.5, (2, 2)), rng.uniform(0, 6, 2)

    def field(x: Array, y: Array) -> Array:
        waves = (
            np.sin(2 * np.pi * (cycle[0] * x / 160 + cycle[1] * y / 120) + phase)
            for cycle, phase in zip(cycles, phases, strict=True)
        )
        return 0.05 * np.stack(list(waves), -1)

    moved_px = field(*MARKERS.T) / SCALE_MM + rng.normal(0, 0.1, MARKERS.shape)
    found = surface().measure_field(MARKERS + moved_px, ALL)
    std_mm = np.median(found.std_cells_mm)
    rows, columns = found.cells_mm.shape[:2]
    x, y = np.meshgrid((np.arange(columns) + 0.5) * 160 / columns, np.arange(rows) * 120 / rows)
    error_mm = np.abs(found.cells_mm - field(x, y + 60 / rows))
    assert 0.5 < np.quantile(error_mm, 0.68) / std_mm < 2


def test_a_surface_that_does_not_move_is_as_certain_as_its_markers() -> None:
    found = surface().measure_field(MARKERS, ALL)
    np.testing.assert_allclose(found.std_cells_mm, 0.06 * SCALE_MM, rtol=1e-5)
