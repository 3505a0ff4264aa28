"""Marker detection in one frame: accuracy, and robustness to shape, illumination and wear."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import KDTree

from tactile_core.algorithms.markers.contrast import Tone, brightness_of, contrast_of
from tactile_core.algorithms.markers.count import find_marker_lattice
from tactile_core.algorithms.markers.detection import find_markers
from tactile_sim import VirtualStage
from tactile_sim.optics.faults import Faults

Array = NDArray[Any]

SHAPE = (240, 320)
FINER = 5


def found(pixels: Array, size_px: float, tone: Tone = "dark") -> tuple[Array, Array]:
    contrast = contrast_of(pixels, diameter_px=size_px, tone=tone)
    return find_markers(contrast, pixels.shape[:2], diameter_px=size_px)


def lattice(
    pitch_px: float, seed: int, shape: tuple[int, int] = SHAPE, *, jitter: float = 1 / 8
) -> Array:
    """Centres a pitch apart with a jitter of a share of it, none near the border."""
    rng = np.random.default_rng(seed)
    axes = (np.arange(pitch_px, side - 0.8 * pitch_px, pitch_px) for side in shape[::-1])
    centres = np.stack(np.meshgrid(*axes), -1).reshape(-1, 2)
    return np.asarray(centres + pitch_px * rng.uniform(-jitter, jitter, centres.shape))


GREY, BLACK = 1.0, 0.03
BLACK_INK, RED_INK, WHITE_INK, PIN = (0.25,) * 3, (0.9, 0.25, 0.25), (1.4,) * 3, (1.2,) * 3


def photograph(
    centres: Array,
    size_px: float,
    outline: str,
    *,
    seed: int = 0,
    ink: tuple[float, float, float] = BLACK_INK,
    gel: float = GREY,
) -> Array:
    """Markers of one outline at random angles, blurred, with uneven illumination and noise."""
    rng = np.random.default_rng(seed)
    fine = np.zeros((SHAPE[0] * FINER, SHAPE[1] * FINER), np.uint8)
    for x, y in centres:
        if outline in ("round", "ring"):
            corners = np.linspace(0, 2 * np.pi, 40)
            radius = size_px / 2
        else:
            count = 4 if outline == "square" else 3
            corners = rng.uniform(0, 7) + 2 * np.pi * np.arange(count) / count
            radius = size_px / (2 * np.sin(np.pi / count))
        points = np.stack([x + radius * np.cos(corners), y + radius * np.sin(corners)], 1)
        cv2.fillPoly(fine, [np.rint(((points + 0.5) * FINER - 0.5) * 16).astype(int)], 255, 8, 4)
        if outline == "ring":
            hole = 0.3 * (points - [x, y]) / 0.5 + [x, y]
            cv2.fillPoly(fine, [np.rint(((hole + 0.5) * FINER - 0.5) * 16).astype(int)], 0, 8, 4)
    cover = cv2.resize(fine, SHAPE[::-1], interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    cover = cv2.GaussianBlur(cover, (0, 0), 1.0)[..., None]
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]] / np.array(SHAPE)[:, None, None]
    light = np.stack([90 + 90 * u, 180 - 110 * v, 150 - 80 * u + 40 * v], axis=2)
    seen = light * (gel + (np.array(ink) - gel) * cover) + rng.normal(0, 1.5, light.shape)
    return np.asarray(np.clip(np.rint(seen), 0, 255), np.uint8)


def misses(truth: Array, centres: Array) -> Array:
    """Distance of each true centre from the nearest detection."""
    return np.asarray(KDTree(centres).query(truth)[0])


outlines = st.sampled_from(["round", "square", "triangle", "ring"])
looks = st.sampled_from(
    [
        ("dark", BLACK_INK, GREY),
        ("dark", RED_INK, GREY),
        ("bright", WHITE_INK, GREY),
        ("bright", PIN, BLACK),
    ]
)
Look = tuple[Tone, tuple[float, float, float], float]


@settings(max_examples=40)
@given(outlines, looks, st.floats(8, 20), st.floats(2.6, 3.5), st.integers(0, 2**32 - 1))
def test_all_markers_and_nothing_else_are_found(
    outline: str, look: Look, size_px: float, ratio: float, seed: int
) -> None:
    tone, ink, gel = look
    truth = lattice(ratio * size_px, seed)
    image = photograph(truth, size_px, outline, seed=seed, ink=ink, gel=gel)
    centres, truncated = found(image, size_px, tone)
    assert centres.dtype == np.float32
    assert len(centres) == len(truth)
    assert not truncated.any()
    assert np.sqrt((misses(truth, centres) ** 2).mean()) < 0.15


@settings(max_examples=20)
@given(outlines, looks, st.floats(8, 14), st.floats(2.6, 3.5), st.integers(0, 2**32 - 1))
def test_tone_and_pitch_of_a_regular_print_are_found(
    outline: str, look: Look, size_px: float, ratio: float, seed: int
) -> None:
    tone, ink, gel = look
    regular = lattice(ratio * size_px, seed, jitter=1 / 40)
    image = photograph(regular, size_px, outline, seed=seed, ink=ink, gel=gel)
    layout = find_marker_lattice(image)
    assert layout is not None
    assert layout.tone == tone
    assert layout.pitch_px == pytest.approx(ratio * size_px, rel=0.04)


@pytest.mark.parametrize("gain", [0.4, 1.3])
def test_illumination_drift_moves_no_marker(gain: float) -> None:
    image = photograph(lattice(36, 1), 12, "square").astype(np.float32)
    centres, _ = found(image, 12)
    drifted, _ = found(image * np.array([gain, 1, 1], np.float32), 12)
    assert misses(centres, drifted).max() < 0.1


@pytest.mark.parametrize("ratio", [0.7, 0.85, 1.2])
def test_an_approximate_diameter_is_enough(ratio: float) -> None:
    truth = lattice(40, 2)
    centres, _ = found(photograph(truth, 13, "round"), ratio * 13)
    assert len(centres) == len(truth)
    assert misses(truth, centres).max() < 0.4


def test_specks_and_thin_lines_are_not_detected() -> None:
    truth = lattice(40, 3)
    image = photograph(truth, 13, "square")
    for x, y in truth[:5]:
        cv2.circle(image, (int(x + 20), int(y + 20)), 2, (20, 20, 20), -1)
    assert len(found(image, 13)[0]) == len(truth)
    cv2.line(image, (0, 20), (319, 25), (40, 40, 40), 2)
    centres, truncated = found(image, 13)
    assert len(centres[~truncated]) == len(truth)
    assert truncated.sum() <= 2  # the ends of a line are truncated like markers


def test_a_truncated_marker_is_flagged_and_its_centre_extrapolated() -> None:
    truth = np.array([[60.0 + 40 * k, y] for y in (1.0, 40.0, 80.0, 120.0) for k in range(6)])
    for outline in ("round", "square"):
        centres, truncated = found(photograph(truth, 14, outline), 14)
        assert truncated.sum() == 6
        assert misses(truth[:6], centres[truncated]).max() < 14 / 5
        assert misses(truth[6:], centres[~truncated]).max() < 0.4


@pytest.mark.parametrize(
    "turned",
    [
        lambda pixels: pixels,
        np.flipud,
        lambda pixels: np.swapaxes(pixels, 0, 1),
        lambda pixels: np.fliplr(np.swapaxes(pixels, 0, 1)),
    ],
    ids=["top", "bottom", "left", "right"],
)
def test_centres_are_extrapolated_beyond_every_border(
    turned: Callable[[Any], Any],
) -> None:
    truth = np.array([[60.0 + 40 * k, y] for y in (1.0, 40.0, 80.0, 120.0) for k in range(6)])
    spots = np.zeros((*SHAPE, 2))
    spots[truth[:, 1].astype(int), truth[:, 0].astype(int)] = np.arange(1, 25)[:, None]
    centres, truncated = found(np.ascontiguousarray(turned(photograph(truth, 14, "round"))), 14)
    places = turned(spots)[..., 0]
    y, x = np.nonzero((places > 0) & (places <= 6))
    assert truncated.sum() == 6
    assert misses(np.stack([x, y], 1), centres[truncated]).max() < 1.2


def test_shading_with_a_third_of_the_contrast_is_not_detected() -> None:
    truth = lattice(30, 6)
    image = photograph(truth, 10, "round").astype(np.float32)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    middle = truth[30] + 15
    image *= 1 - 0.23 * (np.hypot(x - middle[0], y - middle[1]) < 6)[..., None]
    centres, _ = found(cv2.GaussianBlur(image, (0, 0), 0.7).astype(np.uint8), 10)
    assert len(centres) == len(truth)
    assert misses(middle[None], centres)[0] > 10


def furrowed(image: Array, turn_deg: float) -> Array:
    """Uneven furrows as wide as a marker, with up to 0.4 of its contrast, in the middle."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    turn = np.radians(turn_deg)
    across, along = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    depth = np.clip(np.sin(2 * np.pi * across / 20), 0, 1) * (0.75 + 0.25 * np.sin(along / 4))
    pressed = np.clip((SHAPE[1] / 3 - np.abs(x - SHAPE[1] / 2)) / 8, 0, 1)
    return np.asarray((image * (1 - 0.3 * (depth * pressed)[..., None])).astype(np.uint8))


def test_the_furrows_of_a_pressed_object_are_not_detected() -> None:
    truth = lattice(40, 7)
    image = photograph(truth, 12, "square")
    seen = [found(furrowed(image, turn_deg), 12)[0] for turn_deg in range(0, 91, 10)]
    assert np.max([misses(truth, centres).max() for centres in seen]) < 2
    spurious = np.concatenate([misses(centres, truth) > 3 for centres in seen])
    assert spurious.mean() < 0.01


def test_the_dark_edge_of_the_view_is_not_detected() -> None:
    truth = lattice(40, 8)
    image = photograph(truth, 12, "round").astype(np.float32)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] - (np.array(SHAPE)[:, None, None] - 1) / 2
    edges = np.hypot(x, y) > 190  # the four corners
    edges |= np.abs(np.hypot(x, y) - 182) < 2.5  # the rim of the gel: a line across the corners
    image *= np.where(edges, 0.25, 1)[..., None]
    centres, truncated = found(cv2.GaussianBlur(image, (0, 0), 1.0).astype(np.uint8), 12)
    assert truncated.sum() <= 4  # one end of each line
    assert len(centres[~truncated]) == len(truth)
    assert misses(truth, centres).max() < 1


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_all_channels_have_equal_weight_in_the_brightness(dtype: type) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (*SHAPE, 3)).astype(dtype)
    off = brightness_of(pixels, 1).astype(np.float64) - pixels.mean(axis=2)
    assert np.abs(off).max() <= 0.51


@pytest.mark.parametrize("tone", ["dark", "bright"])
@pytest.mark.parametrize("level", [0, 5, 128, 255])
def test_noise_without_markers_gives_no_detection(level: int, tone: Tone) -> None:
    noise = np.random.default_rng(0).normal(0, 1, (*SHAPE, 3))
    centres, truncated = found(np.clip(level + noise, 0, 255).astype(np.uint8), 12, tone)
    assert centres.shape == (0, 2)
    assert truncated.shape == (0,)


def in_view(stage: VirtualStage, size_px: float, border_px: float) -> Array:
    shape = stage.profile.image.height_px, stage.profile.image.width_px
    markers = stage.truth().markers_px
    inside = (markers > border_px).all(1) & (markers < np.array(shape[::-1]) - border_px).all(1)
    return np.asarray(markers[inside])


@pytest.mark.parametrize("outline", ["round", "square", "triangle"])
@pytest.mark.parametrize("layout", ["grid", "quasi_random"])
def test_virtual_markers_are_found_undeformed_and_pressed(outline: str, layout: str) -> None:
    look = {"optics": {"markers": {"shape": outline, "layout": layout}}}
    stage = VirtualStage("hex_fingertip", seed=11, overrides=look)
    size_px = 0.4 / 0.0276
    for depth_mm, limit_px in ((0.0, 0.1), (0.6, 0.15)):
        if depth_mm:
            stage.indenter("sphere", diameter_mm=8, x_mm=1.3, y_mm=-0.7)
            stage.press(depth_mm=depth_mm)
            stage.shear(0.3, 0.2, steps=2)
        centres, truncated = found(stage.frame().pixels, size_px)
        truth = in_view(stage, size_px, size_px)
        apart = misses(truth, centres)
        assert np.sqrt((apart**2).mean()) < limit_px
        assert apart.max() < 1
        assert misses(centres[~truncated], in_view(stage, size_px, 0)).max() < 1


def test_worn_and_merged_markers_are_missed_and_nothing_else_is_detected() -> None:
    faults = Faults(missing_markers=0.08, merged_markers=0.05)
    stage = VirtualStage("hex_fingertip", seed=4, faults=faults)
    size_px, pitch_px = 0.4 / 0.0276, 1.1 / 0.0276
    centres, truncated = found(stage.frame().pixels, size_px)
    truth = in_view(stage, size_px, size_px)
    assert (misses(truth, centres) > 2).mean() < 0.08 + 2 * 0.05
    assert misses(centres[~truncated], truth).max() < pitch_px / 4


def read(path: Path) -> Array:
    image = cv2.imread(str(path))
    assert image is not None, path
    return np.asarray(image[..., ::-1])


@pytest.mark.recordings
def test_the_pins_of_a_real_tactip_are_found_and_bright(recordings: Path) -> None:
    counts = []
    for file in sorted((recordings / "tactip" / "surface" / "frames").iterdir())[:40]:
        image = read(file)
        layout = find_marker_lattice(image)
        assert layout is not None
        assert layout.tone == "bright"
        counts.append(len(found(image, layout.diameter_px, "bright")[0]))
    assert np.mean(counts) == pytest.approx(127, rel=0.01)  # as many as the sensor has


def of_recording(path: Path) -> list[tuple[Array, Array]]:
    """Markers of each frame of a folder; diameter and pitch come from the first."""
    frames = [read(file) for file in sorted(path.iterdir())]
    layout = find_marker_lattice(frames[0])
    assert layout is not None
    return [found(frame, layout.diameter_px) for frame in frames]


@pytest.mark.recordings
def test_all_markers_of_a_real_fingertip_and_no_dirt_are_found(recordings: Path) -> None:
    folder = recordings / "three_colour" / "hex_fingertip"
    layout = find_marker_lattice(read(folder / "frame0.jpg"))
    assert layout is not None
    centres, _ = found(read(folder / "frame0.jpg"), layout.diameter_px)
    # counted by eye: nine rows of ten, of the last one eight, less two of which a third is in view
    assert len(centres) == 88 - 2
    nearest = KDTree(centres).query(centres, k=2)[0][:, 1]
    assert nearest == pytest.approx(layout.pitch_px, rel=0.15)
    for name in ("Im_235_1336917.jpg", "Im_335_1337253.jpg"):
        pressed, _ = found(read(folder / name), layout.diameter_px)
        assert 85 <= len(pressed) <= 88


@pytest.mark.recordings
def test_markers_agree_with_the_labels_of_another_tracker(recordings: Path) -> None:
    folder = recordings / "markers" / "mini"
    labels = defaultdict(list)
    with (folder / "markers.csv").open() as file:
        for row in csv.DictReader(file):
            labels[int(row["frame"]) + 9].append((float(row["x_px"]), float(row["y_px"])))
    seen = of_recording(folder / "frames")
    apart = np.concatenate(
        [misses(np.array(labels[k]), seen[k][0]) for k in labels if k < len(seen)]
    )
    assert (apart < 5).mean() > 0.995
    assert apart.mean() < 0.30
    assert np.percentile(apart, 95) < 0.55


@pytest.mark.recordings
@pytest.mark.parametrize("trial", ["object001/067_00_mm", "object003/052_050_mm"])
def test_faint_and_speckled_markers_are_found_throughout_a_lift(
    recordings: Path, trial: str
) -> None:
    seen = of_recording(recordings / "slip" / "grasp_lift" / trial)
    before = seen[0][0][~seen[0][1]]
    assert len(before) > 60
    kept, places = np.ones(len(before), bool), before
    for centres, _ in seen:
        apart, nearest = KDTree(centres).query(places)
        kept &= apart < 15
        places = centres[nearest]
    assert kept.mean() > 0.98
