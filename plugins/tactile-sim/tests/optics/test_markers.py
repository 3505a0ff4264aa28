import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.virtual_rigs import QUIET, SCALE_MM, SHAPE, level, rig, shift

from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.optics import Faults, RigOptics
from tactile_sim.optics.markers import MarkerPrint

PITCH_MM, SIZE_MM = 2.0, 0.6


def printed(shape: str = "round", layout: str = "grid", **more: object) -> Profile:
    return rig(
        gel={"markers": {"pitch_mm": PITCH_MM, "diameter_mm": SIZE_MM}},
        optics={
            "sensor": QUIET,
            "coat": {"grain": 0.0, "ink": 0.0},
            "lights": {"scatter": 1.0},
            "markers": {"shape": shape, "layout": layout},
        }
        | more,
    )


def ink(optics: RigOptics, *state: object) -> np.ndarray:
    """(H, W) printed share of each pixel."""
    light = optics.expose(level(), *state)[..., 0].astype(float)  # type: ignore[arg-type]
    return np.asarray(1 - light / np.median(light))


def centres(cover: np.ndarray) -> np.ndarray:
    """(N, 2) centroids of the markers that are completely inside the image."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats((cover > 0.02).astype(np.uint8))
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    found = []
    for number in range(1, count):
        left, top, width, height = stats[number, :4]
        if left > 0 and top > 0 and left + width < SHAPE[1] and top + height < SHAPE[0]:
            weight = np.where(labels == number, cover, 0)
            found.append([(weight * x).sum() / weight.sum(), (weight * y).sum() / weight.sum()])
    return np.array(found)


def off_px(found: np.ndarray, true: np.ndarray) -> float:
    """Largest distance of a detected marker from the nearest true one, px."""
    between = np.linalg.norm(found[:, None] - true[None], axis=2)
    return float(between.min(1).max())


@pytest.mark.parametrize("shape", ["round", "square", "triangle"])
@pytest.mark.parametrize("layout", ["grid", "quasi_random"])
def test_markers_are_drawn_at_their_true_positions(shape: str, layout: str) -> None:
    optics = RigOptics(printed(shape, layout), seed=2)
    found = centres(ink(optics))
    assert len(found) > 20
    assert off_px(found, optics.markers_px) < 0.1


@pytest.mark.parametrize(
    ("shape", "area_mm2"),
    [("round", np.pi / 4), ("square", 1.0), ("triangle", np.sqrt(3) / 4)],
)
def test_markers_have_the_area_of_their_size(shape: str, area_mm2: float) -> None:
    optics = RigOptics(printed(shape))
    places = np.full_like(optics.markers_px, np.nan)
    places[0] = 70.2, 50.7
    cover = ink(optics, None, places).sum() * SCALE_MM**2
    assert cover == pytest.approx(area_mm2 * SIZE_MM**2, rel=0.05)


@given(x=st.floats(-0.8, 0.8), y=st.floats(-0.8, 0.8))
def test_markers_move_with_the_gel(x: float, y: float) -> None:
    optics = RigOptics(printed())
    found = centres(ink(optics, shift(x, y)))
    assert off_px(found, optics.markers_px + np.array([x, y]) / SCALE_MM) < 0.1


def test_marker_positions_may_be_given() -> None:
    optics = RigOptics(printed())
    places = np.full_like(optics.markers_px, np.nan)
    places[7] = 60.3, 41.6
    found = centres(ink(optics, None, places))
    np.testing.assert_allclose(found, [[60.3, 41.6]], atol=0.1)


@example(beyond=(0.5, 0.74), corner=(True, True), size_px=16, shape="round")
@example(beyond=(-0.5, -0.74), corner=(False, False), size_px=16, shape="round")
@given(
    beyond=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    corner=st.tuples(st.booleans(), st.booleans()),
    size_px=st.floats(2, 30),
    shape=st.sampled_from(["round", "square", "triangle"]),
)
def test_a_marker_near_a_border_is_drawn_as_inside_a_larger_image(
    beyond: tuple[float, float], corner: tuple[bool, bool], size_px: float, shape: str
) -> None:
    last = np.array(SHAPE[::-1]) - 1
    one = (last * corner + size_px * np.array(beyond))[np.newaxis]
    none = np.zeros(1, bool)
    marker = MarkerPrint(one, np.zeros(1), size_px, shape, 0.0, none, np.zeros((0, 2), int))
    wide = 80
    larger = marker.reflectance((SHAPE[0] + 2 * wide, SHAPE[1] + 2 * wide), one + wide)
    drawn = marker.reflectance(SHAPE, one)
    np.testing.assert_allclose(drawn, larger[wide:-wide, wide:-wide], atol=1e-4)


def test_the_markers_of_2015_are_triangles_a_millimetre_apart() -> None:
    profile = load_profile("baxter_fingertip_marked")
    image = profile.image
    shape = (image.height_px, image.width_px)
    bare = profile.model_copy(update={"gel": profile.gel.model_copy(update={"markers": None})})
    printed_on, blank = (
        RigOptics(p, seed=1).expose(np.zeros(shape)).mean(2) for p in (profile, bare)
    )
    dark = (printed_on < 0.6 * blank).astype(np.uint8)
    count, _, stats, _ = cv2.connectedComponentsWithStats(dark)
    whole = stats[1:, cv2.CC_STAT_AREA][(stats[1:, :2] > 0).all(1)]
    side_mm = np.sqrt(4 / np.sqrt(3) * np.median(whole)) * image.mm_per_px
    assert side_mm == pytest.approx(0.40, abs=0.04)
    area_mm2 = shape[0] * shape[1] * image.mm_per_px**2
    assert np.sqrt(area_mm2 / (count - 1)) == pytest.approx(1.2, rel=0.1)


def test_quasi_random_markers_keep_apart() -> None:
    places = RigOptics(printed(layout="quasi_random"), seed=4).markers_px * SCALE_MM
    between = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(between, np.inf)
    assert between.min() > SIZE_MM
    assert between.min(1).std() > 0.05 * PITCH_MM


def test_markers_may_be_missing_or_merged() -> None:
    whole, worn, merged = (
        len(centres(ink(RigOptics(printed(), seed=3, faults=faults))))
        for faults in (Faults(), Faults(missing_markers=0.3), Faults(merged_markers=0.4))
    )
    assert 0.5 * whole < worn < 0.9 * whole
    assert 0.5 * whole < merged < whole
