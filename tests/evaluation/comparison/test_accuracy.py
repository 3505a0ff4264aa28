"""Scores are the errors of a measurement against the truth."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.errors import InputError
from tactile_core.evaluation.comparison.accuracy import Accuracy, Angles, Arrays, common_names

SHAPE = (12, 16)
ANYWHERE = Path("truth/ball.npz")


def surface(seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {
        "height_mm": rng.normal(0, 0.2, SHAPE).astype(np.float32),
        "gradients": rng.normal(0, 0.3, (*SHAPE, 2)).astype(np.float32),
        "contact": rng.random(SHAPE) < 0.4,
        "valid": np.ones(SHAPE, bool),
        "displacement_mm": rng.normal(0, 0.1, (*SHAPE, 2)).astype(np.float32),
        "wrench": np.array([0.1, 0.2, 3.0, 5.0], np.float32),
        "mm_per_px": np.asarray(0.05),
    }


def scored(*pairs: tuple[Arrays, Arrays]) -> dict:
    accuracy = Accuracy()
    for measured, truth in pairs:
        accuracy.add(measured, truth, common_names(measured, truth, ANYWHERE))
    return accuracy.summary()


def test_the_truth_itself_has_no_error() -> None:
    score = scored((surface(), surface()))
    assert score["normal_error_deg"] == {"mean": 0, "median": 0, "p90": 0}
    assert score["height_rmse_mm"] == score["height_rmse_in_contact_mm"] == 0
    assert score["peak_error_mm"] == 0
    assert score["iou"] == {"contact": 1}
    assert score["rmse"] == {"displacement_mm": 0, "wrench": [0, 0, 0, 0]}


@given(tilt_deg=st.floats(0, 80), azimuth=st.floats(0, 6.28))
def test_a_tilted_plane_measured_as_level_has_its_tilt_as_error(
    tilt_deg: float, azimuth: float
) -> None:
    slope = np.tan(np.radians(tilt_deg)) * np.array([np.cos(azimuth), np.sin(azimuth)])
    tilted = surface() | {"gradients": np.broadcast_to(slope, (*SHAPE, 2))}
    score = scored((surface() | {"gradients": np.zeros((*SHAPE, 2))}, tilted))
    for normals in (score["normal_error_deg"], score["normal_error_in_contact_deg"]):
        assert normals["mean"] == pytest.approx(tilt_deg, abs=1e-3)
        assert normals["median"] == pytest.approx(tilt_deg, abs=0.006)
        assert normals["p90"] == pytest.approx(tilt_deg, abs=0.006)


@given(offset_mm=st.floats(-2, 2))
def test_a_height_offset_is_the_height_error(offset_mm: float) -> None:
    truth = surface()
    raised = truth | {"height_mm": truth["height_mm"].astype(float) + offset_mm}
    score = scored((raised, truth))
    for name in ("height_rmse_mm", "height_rmse_in_contact_mm", "peak_error_mm"):
        assert score[name] == pytest.approx(abs(offset_mm), abs=1e-5)


@given(sizes=st.lists(st.integers(1, 200), min_size=1, max_size=4))
def test_quantiles_are_those_of_all_angles_together(sizes: list[int]) -> None:
    rng = np.random.default_rng(sum(sizes))
    parts = [rng.uniform(0, 180, size) for size in sizes]
    angles, everything = Angles(), np.concatenate(parts)
    for part in parts:
        angles.add(part)
    summary = angles.summary()
    assert summary is not None
    assert summary["mean"] == pytest.approx(everything.mean(), abs=1e-3)
    for name, share in (("median", 50), ("p90", 90)):
        exact = np.percentile(everything, share, method="inverted_cdf")
        assert summary[name] == pytest.approx(exact, abs=0.0051)


def test_frames_are_pooled_by_their_pixels() -> None:
    truth = surface()
    off_by_3 = truth | {"height_mm": truth["height_mm"] + 3}
    off_by_4 = truth | {"height_mm": truth["height_mm"] + 4}
    score = scored((off_by_3, truth), (off_by_4, truth))
    assert score["height_rmse_mm"] == pytest.approx(np.sqrt(12.5), rel=1e-5)
    assert score["peak_error_mm"] == pytest.approx(3.5, rel=1e-5)


def test_half_of_the_contact_scores_an_iou_of_one_half() -> None:
    truth = surface() | {"contact": np.zeros(SHAPE, bool)}
    truth["contact"][:, :8] = True
    half = np.zeros(SHAPE, bool)
    half[:, :4] = True
    assert scored((truth | {"contact": half}, truth))["iou"] == {"contact": 0.5}


def test_the_error_of_a_vector_field_is_the_length_of_the_difference() -> None:
    truth = surface()
    moved = truth | {"displacement_mm": truth["displacement_mm"] + np.array([0.3, 0.4])}
    assert scored((moved, truth))["rmse"]["displacement_mm"] == pytest.approx(0.5, abs=1e-6)


def test_forces_and_torque_are_not_mixed() -> None:
    pressed = surface() | {"wrench": np.array([0.1, 0.2, 4.0, 5.5])}
    assert scored((pressed, surface()))["rmse"]["wrench"] == pytest.approx([0, 0, 1, 0.5], abs=1e-6)


def test_arrays_without_truth_are_not_scored() -> None:
    truth = {"height_mm": surface()["height_mm"]}
    score = scored((surface(), truth))
    assert score["normal_error_deg"] is None
    assert score["height_rmse_in_contact_mm"] is None
    assert score["iou"] == {}


def test_a_truth_of_another_size_is_refused() -> None:
    smaller = surface() | {"height_mm": np.zeros((6, 8), np.float32)}
    with pytest.raises(InputError, match="height_mm is 6 × 8 but 12 × 16 was measured"):
        common_names(surface(), smaller, ANYWHERE)


def test_a_true_contact_of_another_size_is_refused_even_if_none_was_measured() -> None:
    measured = {name: array for name, array in surface().items() if name != "contact"}
    with pytest.raises(InputError, match="contact is 6 × 8"):
        common_names(measured, surface() | {"contact": np.zeros((6, 8), bool)}, ANYWHERE)


def test_a_contact_of_zeros_and_ones_is_a_mask() -> None:
    truth = surface()
    assert scored((surface(), truth | {"contact": truth["contact"].astype(np.uint8)})) == scored(
        (surface(), truth)
    )


def test_a_truth_at_another_scale_is_refused() -> None:
    with pytest.raises(InputError, match=r"0\.06 mm per pixel"):
        common_names(surface(), surface() | {"mm_per_px": np.asarray(0.06)}, ANYWHERE)


@pytest.mark.parametrize("scale", [np.array([0.05, 0.05]), np.array([]), np.array("wide")])
def test_a_truth_without_one_scale_is_refused(scale: np.ndarray) -> None:
    with pytest.raises(InputError, match="mm_per_px is not one number"):
        common_names(surface(), surface() | {"mm_per_px": scale}, ANYWHERE)


def test_a_truth_with_nan_is_refused() -> None:
    truth = surface()
    truth["height_mm"][3, 3] = np.nan
    with pytest.raises(InputError, match="not finite"):
        common_names(surface(), truth, ANYWHERE)


@pytest.mark.parametrize("dtype", ["complex64", "U8"])
def test_a_truth_that_is_not_numeric_is_not_scored(dtype: str) -> None:
    truth = surface() | {"gradients": surface()["gradients"].astype(dtype)}
    assert scored((surface(), truth))["normal_error_deg"] is None
