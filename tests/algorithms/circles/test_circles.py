"""Circles of rendered presses against the ground truth."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.circles import finder
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.finder import find_circles, fit_light, locate
from tactile_core.algorithms.circles.grid import refine_grid
from tactile_core.algorithms.circles.press import PressImage, change_of
from tactile_core.algorithms.circles.press_fit import PRESS_FIT, slope_around
from tactile_core.algorithms.circles.start import DIFFERS, Start
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_sim.optics.rig import render


@dataclass(frozen=True)
class Bench:
    lab: VirtualLab
    reference: np.ndarray
    balls: list[BallPress]

    @property
    def ball_px(self) -> float:
        return BALL_MM / 2 / self.lab.profile.image.mm_per_px

    def image(self, ball: BallPress | None, seed: int = 50) -> PressImage:
        return PressImage.prepare(self.lab.image(ball, seed), self.reference)

    def presses(self) -> list[PressImage]:
        return [self.image(ball, seed) for seed, ball in enumerate(self.balls)]

    def off_px(self, circles: list[Circle]) -> np.ndarray:
        found = np.array([circle.centre_px for circle in circles])
        return np.hypot(*(found - [ball.centre_px for ball in self.balls]).T)

    def radius_off_px(self, circles: list[Circle]) -> np.ndarray:
        """Distance from where the slope is the level of the border, relative to the ball's."""
        true = [left_at_mm(ball) / self.lab.profile.image.mm_per_px for ball in self.balls]
        return np.abs(np.array([circle.contact_radius_px for circle in circles]) - true)

    def starts(self, images: list[PressImage]) -> list[Start]:
        return [Start.from_image(image, self.ball_px) for image in images]

    def find(self, images: list[PressImage]) -> list[Circle]:
        return find_circles(self.starts(images))


def left_at_mm(ball: BallPress) -> float:
    """Distance from the centre at which the sine of the slope is below that of the ball."""
    step_mm = 0.005
    centred = replace(ball, centre_px=(0.0, 0.0))
    fall = -np.diff(centred.height_mm((1, int(BALL_MM / 2 / step_mm)), step_mm)[0]) / step_mm
    r_mm = (np.arange(len(fall)) + 0.5) * step_mm
    ratio = fall / np.sqrt(1 + fall**2) / (2 * r_mm / BALL_MM)
    return float(r_mm[np.argmax(ratio < PRESS_FIT.level)])


@pytest.fixture(scope="module")
def bench(lab: VirtualLab) -> Bench:
    rng = np.random.default_rng(21)
    balls = [
        BallPress((float(rng.uniform(18, 142)), float(rng.uniform(18, 102))), BALL_MM, depth)
        for depth in np.linspace(0.5, 1.0, 12)
    ]
    return Bench(lab, lab.image(None, 0).astype(np.float32), balls)


@pytest.fixture(scope="module")
def circles(bench: Bench) -> list[Circle]:
    return bench.find(bench.presses())


def test_every_press_is_located_to_a_fraction_of_a_pixel(
    bench: Bench, circles: list[Circle]
) -> None:
    assert all(circle.used for circle in circles)
    assert np.median(bench.off_px(circles)) < 0.15
    assert bench.off_px(circles).max() < 0.5


def test_the_contact_ends_where_the_surface_has_left_the_ball(
    bench: Bench, circles: list[Circle]
) -> None:
    assert np.median(bench.radius_off_px(circles)) < 0.8


def test_the_slope_around_a_contact_falls_as_its_derivatives_say() -> None:
    r = np.linspace(0.3, 1.2, 40, dtype=np.float32)
    slope, step = slope_around(r, 0.6, 0.3), 1e-3
    wider, nearer = (slope_around(r, 0.6 + way, 0.3) for way in (step, -step))
    slower, faster = (slope_around(r, 0.6, 0.3 * np.exp(way)) for way in (step, -step))
    assert slope.ratio[r < 0.5] == pytest.approx(1)
    assert np.interp(0.6, r, slope.ratio) == pytest.approx(PRESS_FIT.level, abs=0.01)
    smooth = np.abs(r - 0.54) > 0.02
    by_contact = (wider.ratio - nearer.ratio) / (2 * step)
    by_decay = (slower.ratio - faster.ratio) / (2 * step)
    assert slope.by_contact[smooth] == pytest.approx(by_contact[smooth], abs=1e-3)
    assert slope.by_decay[smooth] == pytest.approx(by_decay[smooth], abs=1e-3)


def test_a_working_image_of_any_size_keeps_every_place() -> None:
    x, y = np.meshgrid(np.arange(131.0), np.arange(97.0))
    blob = 40 * np.exp(-((x - 101) ** 2 + (y - 83) ** 2) / 50)[..., None]
    change = change_of(PressImage(100 + blob, np.full(blob.shape, 100.0)), 0.37)
    values = change.values[..., 0] - change.values[0, 0, 0]
    rows, columns = np.indices(values.shape)
    centre = np.array([(columns * values).sum(), (rows * values).sum()]) / values.sum()
    assert change.to_image(centre) == pytest.approx((101, 83), abs=0.05)
    assert change.to_working(np.array([101.0, 83.0])) == pytest.approx(centre, abs=0.02)


def test_the_order_of_presses_does_not_matter(bench: Bench, circles: list[Circle]) -> None:
    backwards = bench.find(bench.presses()[::-1])[::-1]
    moved = np.array([a.centre_px for a in circles]) - [b.centre_px for b in backwards]
    assert np.abs(moved).max() < 0.02


def test_a_larger_image_gives_the_same_circles(bench: Bench, circles: list[Circle]) -> None:
    def twice(pixels: np.ndarray) -> np.ndarray:
        return np.repeat(np.repeat(pixels, 2, axis=0), 2, axis=1)

    images = [PressImage(twice(p.pixels), twice(p.reference)) for p in bench.presses()]
    found = find_circles([Start.from_image(image, 2 * bench.ball_px) for image in images])
    centres = (np.array([c.centre_px for c in found]) - 0.5) / 2
    assert np.abs(centres - [c.centre_px for c in circles]).max() < 0.2


def test_a_held_out_press_is_located_with_the_light_of_the_others(
    bench: Bench, circles: list[Circle]
) -> None:
    left_out, *others = bench.starts(bench.presses())
    found = locate(left_out, fit_light(others, circles[1:]))
    assert np.hypot(*np.subtract(found.centre_px, bench.balls[0].centre_px)) < 0.3


def test_a_held_out_press_moves_until_centre_and_contact_agree(
    bench: Bench, circles: list[Circle], monkeypatch: pytest.MonkeyPatch
) -> None:
    left_out, *others = bench.starts(bench.presses())
    light = fit_light(others, circles[1:])
    found = locate(left_out, light)
    monkeypatch.setattr(finder, "_ROUNDS", 40)
    settled = locate(left_out, light)
    assert np.hypot(*np.subtract(found.centre_px, settled.centre_px)) < 0.03
    assert found.contact_radius_px == pytest.approx(settled.contact_radius_px, abs=0.1)


def lit(pixels: np.ndarray) -> np.ndarray:
    """The image under a light that falls by ten from left to right, 12 bits deep."""
    return np.asarray(pixels) * np.geomspace(14.0, 1.4, pixels.shape[1])[:, None]


def test_light_that_falls_by_ten_leaves_the_circles_where_they_are(
    bench: Bench, circles: list[Circle]
) -> None:
    reference = lit(bench.reference)
    images = [PressImage(lit(press.pixels), reference, 4095.0) for press in bench.presses()]
    found = bench.find(images)
    assert all(circle.used for circle in found)
    moved = np.array([a.centre_px for a in found]) - [b.centre_px for b in circles]
    assert np.abs(moved).max() < 0.2


def darkened(bench: Bench, ball: BallPress, seed: int) -> PressImage:
    shape = bench.reference.shape[:2]
    deep = np.exp(-ball.height_mm(shape, bench.lab.profile.image.mm_per_px))
    noise = np.random.default_rng(seed).normal(0, 1, (*shape, 1))
    return PressImage(150 * deep[..., None] + noise, np.full((*shape, 1), 150.0))


def test_circles_are_found_where_the_image_darkens_with_depth(bench: Bench) -> None:
    found = bench.find([darkened(bench, ball, i) for i, ball in enumerate(bench.balls)])
    assert all(circle.used for circle in found)
    assert np.median(bench.off_px(found)) < 0.3
    assert np.median(bench.radius_off_px(found)) < 1.5


def test_balls_of_two_sizes_are_found_together(bench: Bench) -> None:
    sizes = [1.0, 1.5] * (len(bench.balls) // 2)
    balls = [
        BallPress(ball.centre_px, size * BALL_MM, ball.depth_mm)
        for ball, size in zip(bench.balls, sizes, strict=True)
    ]
    starts = [
        Start.from_image(bench.image(ball, seed), size * bench.ball_px)
        for seed, (ball, size) in enumerate(zip(balls, sizes, strict=True))
    ]
    found = find_circles(starts)
    assert all(circle.used for circle in found)
    assert np.median(bench.off_px(found)) < 0.25


def test_a_contact_that_the_border_cuts_in_half_is_located(bench: Bench) -> None:
    cut = BallPress((1.0, 60.0), BALL_MM, 0.8)
    *_, found = bench.find([*bench.presses(), bench.image(cut, 70)])
    assert np.hypot(*np.subtract(found.centre_px, cut.centre_px)) < 0.5


@pytest.mark.parametrize(
    "spoil",
    [lambda pixels: pixels * (1, 1, 0.85), lambda pixels: np.roll(pixels, 20, axis=1)],
    ids=["blue is down", "another crop"],
)
def test_a_reference_of_other_images_is_named_as_the_reason(bench: Bench, spoil) -> None:
    reference = lit(bench.reference)
    images = [PressImage(spoil(lit(press.pixels)), reference, 4095.0) for press in bench.presses()]
    assert {circle.why for circle in bench.find(images)} == {DIFFERS}


def two_balls(bench: Bench) -> PressImage:
    first, second = (bench.image(ball).pixels.astype(float) for ball in bench.balls[:2])
    both = np.clip(first + second - bench.reference, 0, 255)
    return PressImage.prepare(both.astype(np.uint8), bench.reference)


def changed(bench: Bench, pixels: np.ndarray) -> PressImage:
    return PressImage.prepare(np.clip(pixels, 0, 255).astype(np.uint8), bench.reference)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda bench: bench.image(None),
        lambda bench: changed(bench, bench.reference),
        lambda bench: changed(bench, bench.reference * 1.3),
        lambda bench: changed(bench, np.roll(bench.reference, 3, axis=1) * 1.05),
        two_balls,
    ],
    ids=["undeformed", "the reference itself", "a flash", "moved and brighter", "two balls"],
)
def test_frames_that_are_no_press_of_one_ball_are_excluded_with_a_reason(
    bench: Bench, spoil, circles: list[Circle]
) -> None:
    *good, bad = bench.find([*bench.presses(), spoil(bench)])
    assert not bad.used
    assert bad.why
    assert all(circle.used for circle in good)


def test_undeformed_frames_give_no_circle(bench: Bench) -> None:
    assert not any(circle.used for circle in bench.find([bench.image(None, s) for s in range(4)]))


def grid_of(bench: Bench, spots: np.ndarray, ball_mm: float) -> PressImage:
    profile = bench.lab.profile
    balls = [BallPress((x, y), ball_mm, 0.18 * ball_mm) for x, y in spots]
    shape, mm_per_px = bench.reference.shape[:2], profile.image.mm_per_px
    together = np.sum([ball.height_mm(shape, mm_per_px) for ball in balls], axis=0)
    return PressImage.prepare(render(profile, together, seed=50), bench.reference)


@pytest.mark.parametrize(
    ("columns", "rows", "ball_mm", "wrong_px", "left_px"),
    [(3, 2, BALL_MM, 1.5, 0.5), (6, 5, 0.55 * BALL_MM, 1.0, 0.5)],
    ids=["a few balls", "many balls"],
)
def test_a_grid_is_refined_from_approximate_centres(
    bench: Bench, columns: int, rows: int, ball_mm: float, wrong_px: float, left_px: float
) -> None:
    x, y = np.meshgrid(np.linspace(25, 135, columns), np.linspace(25, 95, rows))
    rng = np.random.default_rng(4)
    spots = np.column_stack([x.ravel(), y.ravel()]) + rng.uniform(-0.5, 0.5, (x.size, 2))
    rough = spots + rng.uniform(-wrong_px, wrong_px, spots.shape)
    ball_px = ball_mm / 2 / bench.lab.profile.image.mm_per_px
    circles, _ = refine_grid(grid_of(bench, spots, ball_mm), rough, ball_px)
    off = np.hypot(*(np.array([c.centre_px for c in circles]) - spots).T)
    true_px = BallPress((0, 0), ball_mm, 0.18 * ball_mm).contact_radius_mm / ball_mm * 2 * ball_px
    assert all(circle.used for circle in circles)
    assert np.median(off) < left_px
    assert abs(circles[0].contact_radius_px / true_px - 1) < 0.15


def test_a_ball_outside_the_frame_is_excluded_from_the_grid(bench: Bench) -> None:
    spots = np.array([(x, y) for y in (30.0, 60.0, 90.0) for x in (30.0, 60.0, 90.0, 120.0)])
    frame = grid_of(bench, spots, 0.5 * BALL_MM)
    given = np.concatenate([spots, [(400.0, 50.0)]])
    (*circles, absent), _ = refine_grid(frame, given, 0.5 * bench.ball_px)
    assert all(circle.used for circle in circles)
    assert not absent.used
    assert "outside" in absent.why
