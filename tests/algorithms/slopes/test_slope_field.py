from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tactile_core.algorithms.arrays.shrinking import coarse_size
from tactile_core.algorithms.slopes.colour_table import Axis, bake
from tactile_core.algorithms.slopes.slope_field import SlopeField


def model(features: np.ndarray) -> np.ndarray:
    """Return a model that is smooth in colour and whose gain varies over the image."""
    gain = 0.4 * (1 + 0.3 * features[:, 3:4])
    nx = features[:, 0] - 0.5 * features[:, 1] + 0.3 * features[:, 0] * features[:, 2]
    ny = 0.9 * features[:, 1] - 0.5 * features[:, 2]
    return np.asarray(gain * np.stack([nx, ny], 1), np.float32)


@pytest.fixture(scope="module")
def scene() -> tuple[np.ndarray, np.ndarray]:
    """A frame with waves of colour, and the reference."""
    y, x = np.mgrid[:240, :320]
    reference = np.stack([110 + 0.1 * x, 130 - 0.1 * y, 120 + 0 * x], 2).astype(np.float32)
    waves = [np.sin(x / 30 + k) * np.cos(y / 40 - k) for k in range(3)]
    frame = reference * (1 + 0.3 * np.stack(waves, 2))
    return np.rint(frame).astype(np.uint8), reference


def both_ways(frame: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    table = bake(model, Axis(per_unit=80, first=45, count=80))
    fast = np.stack(SlopeField(model, table, reference).measure(frame).image(frame.shape[:2]))
    exact = np.stack(SlopeField(model, None, reference).measure(frame).image(frame.shape[:2]))
    return fast, exact


def test_the_table_agrees_with_the_model_everywhere(
    scene: tuple[np.ndarray, np.ndarray],
) -> None:
    fast, exact = both_ways(*scene)
    assert np.abs(fast - exact).mean() < 0.006
    assert np.abs(fast - exact).max() < 0.04


def test_floats_and_bytes_agree_to_an_entry(
    scene: tuple[np.ndarray, np.ndarray],
) -> None:
    frame, reference = scene
    bytes_, _ = both_ways(frame, reference)
    floats, _ = both_ways(frame.astype(np.float32), reference)
    assert np.abs(bytes_ - floats).mean() < 0.006


def test_the_undeformed_surface_is_flat(
    scene: tuple[np.ndarray, np.ndarray],
) -> None:
    _, reference = scene
    fast, exact = both_ways(np.rint(reference).astype(np.uint8), reference)
    assert np.abs(fast).max() < 0.02
    assert np.abs(exact).max() < 0.01


@pytest.mark.parametrize(
    ("size", "expected"), [((480, 640), (40, 30)), ((320, 240), (30, 40)), ((1080, 1920), (48, 27))]
)
def test_the_coarse_grid_divides_common_images(
    size: tuple[int, int], expected: tuple[int, int]
) -> None:
    assert coarse_size(*size, 1_200) == expected


@pytest.mark.parametrize("size", [(241, 317), (101, 499), (7, 6000)])
def test_the_coarse_grid_has_about_the_requested_points_at_any_size(size: tuple[int, int]) -> None:
    columns, rows = coarse_size(*size, 1_200)
    assert 400 < columns * rows < 4000


def test_threads_do_not_disturb_each_other(scene: tuple[np.ndarray, np.ndarray]) -> None:
    frame, reference = scene
    field = SlopeField(model, bake(model, Axis(per_unit=80, first=45, count=80)), reference)
    frames = [np.roll(frame, shift, axis=1) for shift in range(0, 120, 10)]
    alone = [np.stack(field.measure(each)[:2]) for each in frames]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda each: np.stack(field.measure(each)[:2]), frames))
    np.testing.assert_array_equal(together, alone)


def test_slopes_stay_bounded_for_impossible_colours(
    scene: tuple[np.ndarray, np.ndarray],
) -> None:
    def wild(features: np.ndarray) -> np.ndarray:
        return 40 * model(features)

    frame, reference = scene
    field = SlopeField(wild, bake(wild, Axis(per_unit=80, first=45, count=80)), reference)
    gx, gy, *_ = field.measure(255 - frame)
    assert np.hypot(gx, gy).max() < 5


def test_six_channels_evaluate_the_model_in_every_cell() -> None:
    def six(features: np.ndarray) -> np.ndarray:
        return np.asarray(features[:, 4:6], np.float32)

    reference = np.full((150, 200, 6), 100, np.float32)
    frame = reference.astype(np.uint16)
    frame[..., 4] = 110
    gx, gy, *_ = SlopeField(six, None, reference).measure(frame)
    np.testing.assert_allclose(gx, 0.1 / np.sqrt(1 - 0.01), rtol=1e-5)
    np.testing.assert_allclose(gy, 0, atol=1e-6)


@pytest.mark.parametrize("bytes_", [False, True])
def test_the_undeformed_surface_is_flat_under_its_markers_too(
    scene: tuple[np.ndarray, np.ndarray], bytes_: bool
) -> None:
    _, reference = scene
    marker_mask = np.zeros(reference.shape[:2], np.bool_)
    for row in range(20, 230, 30):
        for column in range(20, 310, 30):
            marker_mask[row : row + 8, column : column + 8] = True
    printed = np.where(marker_mask[..., None], 20, reference).astype(np.float32)
    table = bake(model, Axis(per_unit=80, first=45, count=80))
    field = SlopeField(model, table, printed, marker_mask)
    frame = np.rint(printed).astype(np.uint8) if bytes_ else printed
    gx, gy, *_ = field.measure(frame, marker_mask)
    assert np.hypot(gx, gy).max() < 0.03


@pytest.mark.parametrize("marked", [False, True])
def test_slopes_for_heights_are_means_over_wider_cells(marked: bool) -> None:
    y, x = np.mgrid[:480, :640]
    waves = [np.sin(x / 40 + k) * np.cos(y / 50 - k) for k in range(3)]
    reference = np.full((480, 640, 3), 120, np.float32)
    frame = np.rint(reference * (1 + 0.3 * np.stack(waves, 2))).astype(np.uint8)
    markers = (x % 40 < 9) & (y % 40 < 9) if marked else None
    if markers is not None:
        frame[markers], reference[markers] = 20, 20
    table = bake(model, Axis(per_unit=80, first=45, count=80))
    field = SlopeField(model, table, reference, markers)
    fine, wide = field.measure(frame, markers), field.for_heights(frame, markers)
    means = fine.for_heights()
    assert wide.averaged
    assert wide.gx.shape == means.gx.shape == (120, 160)
    assert wide.step_px == means.step_px == 2 * fine.step_px
    for direct, averaged in zip(wide[:2], means[:2], strict=True):
        assert np.abs(direct - averaged).mean() < (0.006 if marked else 0.003)
        assert np.abs(direct - averaged).max() < (0.06 if marked else 0.02)


@pytest.mark.parametrize("shape", [(240, 320), (478, 638)])
def test_slopes_for_heights_keep_a_grid_that_is_coarse_or_odd_already(
    shape: tuple[int, int],
) -> None:
    reference = np.full((*shape, 3), 120, np.float32)
    table = bake(model, Axis(per_unit=80, first=45, count=80))
    field = SlopeField(model, table, reference)
    frame = reference.astype(np.uint8)
    assert field.for_heights(frame).step_px == field.measure(frame).step_px
