"""Pictures are legible, state their scale and do not exaggerate noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.quantities.fields import Outline, Surface
from tactile_core.views.maps import Overlay, deviation, relief
from tactile_core.views.pictures import side_by_side
from tactile_core.views.shading import (
    blank,
    colours,
    diverging_colours,
    round_length,
    shade_heights,
    text_size,
    tick_label,
    ticks,
    write,
)


def bump(rows: int, columns: int, mm_per_px: float = 0.1, depth_mm: float = 1.0) -> Surface:
    y, x = np.mgrid[:rows, :columns]
    square = ((x - columns / 2) ** 2 + (y - rows / 2) ** 2) / (0.15 * columns) ** 2
    height = (depth_mm * np.exp(-square)).astype(np.float32)
    return Surface(height, mm_per_px)


def flat(rows: int = 48, columns: int = 64) -> Surface:
    return Surface(np.zeros((rows, columns), np.float32), 0.1)


@pytest.mark.parametrize("shape", [(120, 160), (320, 240), (480, 640), (1080, 1920), (2, 2)])
def test_pictures_of_every_sensor_are_large_enough(shape: tuple[int, int]) -> None:
    height = bump(*shape)
    contact = Overlay([Outline(height.mm > 0.5)])
    picture = relief(height, contact, title="press_04")
    assert picture.dtype == np.uint8
    assert picture.shape[2] == 3
    assert max(picture.shape) >= 640
    assert picture.shape[0] > shape[0]
    assert picture.shape[1] > shape[1]


def test_an_undeformed_gel_has_a_uniform_colour() -> None:
    picture = relief(flat())
    inside = picture[200:400, 200:500].reshape(-1, 3)
    assert np.ptp(inside, axis=0).max() == 0


def test_weak_noise_does_not_span_the_colour_bar() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-3, (480, 640)).astype(np.float32)
    inside = relief(Surface(noise, 0.1))[100:400, 100:600].astype(float)
    assert inside.reshape(-1, 3).std(0).max() < 25


def test_the_light_comes_from_the_upper_left() -> None:
    height = bump(100, 100)
    picture = shade_heights(height.mm, 0.1, 0.0, 1.0).astype(int).sum(2)
    assert picture[40, 40] > picture[60, 60] + 60  # a bump, not a dent


def test_lightness_increases_evenly_with_height() -> None:
    weights = np.array([0.2126, 0.7152, 0.0722])
    linear = (colours(16) / 255.0) ** 2.2 @ weights
    lightness = np.cbrt(linear)  # as perceived
    steps = np.diff(lightness)
    assert (steps > 0).all()
    assert steps.max() < 2 * steps.min()


def test_a_contact_is_outlined_unless_it_is_empty() -> None:
    height = bump(120, 160)
    empty = Overlay([Outline(np.zeros((120, 160), bool))])
    contact = Overlay([Outline(height.mm > 0.5)])
    plain = relief(height)[60:500]
    assert np.array_equal(relief(height, empty)[60:500], plain)
    changed = (relief(height, contact)[60:500] != plain).any(2)
    assert 0 < changed.mean() < 0.05


@given(st.floats(1e-5, 1e5))
def test_a_round_length_is_the_largest_within_the_limit(most: float) -> None:
    length = round_length(most)
    assert length <= most * (1 + 1e-6)
    assert length > most / 2.51
    assert float(f"{length:.0e}"[0]) in (1, 2, 5)


@given(st.floats(-50, 50), st.floats(1e-3, 100))
def test_ticks_are_few_distinct_and_in_range(low: float, span: float) -> None:
    values = ticks(low, low + span)
    assert 2 <= len(values) <= 8
    assert min(values) >= low - 1e-5 * span
    assert max(values) <= low + span * (1 + 1e-5)
    labels = [tick_label(value, values[1] - values[0]) for value in values]
    assert len(set(labels)) == len(labels)


def test_tick_labels_have_the_decimals_of_their_step() -> None:
    assert tick_label(0.25, 0.05) == "0.25"
    assert tick_label(-0.2, 0.1) == "−0.2"
    assert tick_label(-0.0, 0.1) == "0.0"
    assert tick_label(20.0, 10.0) == "20"


def test_pictures_side_by_side_have_the_same_height() -> None:
    small, large = relief(flat(48, 64)), np.zeros((900, 300, 3), np.uint8)
    sheet = side_by_side([small, large], ["measured", "true"])
    assert sheet.shape[0] > 900
    assert sheet.shape[1] > 300 + small.shape[1] * 900 / small.shape[0]
    with pytest.raises(ValueError, match="zip"):
        side_by_side([small], ["one", "two"])


def test_a_long_title_is_truncated_for_the_numbers() -> None:
    height = bump(120, 160)
    long = relief(height, title="n" * 300)
    assert long.shape == relief(height, title="n").shape
    assert (long[:20, -60:] == long[0, 0]).all()


@pytest.mark.parametrize("name", ["\udcc3\udca9", "a\udcff", "é", "漢", ""])
def test_a_name_in_any_encoding_can_be_written(name: str) -> None:
    # OpenCV aborts the process on text that is not UTF-8
    assert text_size(name, 1.0)[0] >= 0
    sheet = blank(40, 100)
    write(sheet, name, (2, 30), 1.0)
    assert (sheet != blank(40, 100)).any() == bool(name)


def test_negative_is_blue_positive_red_and_zero_white() -> None:
    negative, zero, positive = diverging_colours(np.array([-1, 0, 1], np.float32)).astype(int)
    assert negative[2] > negative[0]
    assert positive[0] > positive[2]
    assert zero.min() > 240
    assert np.ptp(zero) < 5


def test_a_correct_map_is_white_and_a_too_high_one_red() -> None:
    truth = bump(48, 64)
    raised = Surface(truth.mm + np.float32(0.2), truth.mm_per_px)
    correct, too_high = (deviation(m, truth, most_mm=0.2) for m in (truth, raised))
    assert correct.shape == too_high.shape == relief(truth).shape
    middle = (slice(200, 300), slice(200, 300))
    assert correct[middle].min() > 240
    assert too_high[middle][..., 0].mean() > too_high[middle][..., 2].mean() + 60


def test_pictures_with_the_same_span_have_the_same_colour_bar() -> None:
    low, high = (relief(bump(60, 80, depth_mm=d), span_mm=(0.0, 1.0)) for d in (0.5, 1.0))
    bar = np.s_[60:-60, -85:-75]
    assert np.array_equal(low[bar], high[bar])
    middle = np.s_[low.shape[0] // 2 - 20 : low.shape[0] // 2, 320:340]
    assert not np.array_equal(low[middle], high[middle])
