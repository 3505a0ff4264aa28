"""Wear of the gel, on virtual sensors."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest

from tactile_core.algorithms.wear import WEAR, WearMap
from tactile_core.sim import VirtualStage
from tactile_core.sim.optics import Faults

RIG = "baxter_fingertip"
FRAMES = 5


@cache
def pictures(scratches: int = 0, first: int = 0) -> list[np.ndarray]:
    """Images of the undeformed sensor, each with its own noise."""
    stage = VirtualStage(RIG, faults=Faults(scratches=scratches), compiled=False)
    return [stage.frame().pixels for _ in range(first + FRAMES)][first:]


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    return np.mean(pictures(), axis=0, dtype=np.float32)


def share(reference: np.ndarray, shown: list[np.ndarray], **options: np.ndarray) -> float | None:
    wear = WearMap(reference, 255.0, **options)
    for pixels in shown:
        wear.add(pixels)
    return wear.share


def test_an_undamaged_gel_looks_like_its_reference(reference: np.ndarray) -> None:
    worn = share(reference, pictures(0, FRAMES))
    assert worn is not None
    assert worn < 0.0005


def test_scratches_are_wear_and_more_of_them_more(reference: np.ndarray) -> None:
    few, many = (share(reference, pictures(n, FRAMES)) for n in (10, 50))
    assert few is not None
    assert many is not None
    assert 0.01 < few < 0.04
    assert 0.04 < many < 0.2


def test_lost_coating_is_wear_of_its_area(reference: np.ndarray) -> None:
    spot = cv2.circle(np.ones(reference.shape[:2], np.float32), (300, 200), 60, 0.5, -1)
    worn = share(reference, [p * spot[..., None] for p in pictures(0, FRAMES)])
    assert worn == pytest.approx(np.pi * 60**2 / spot.size, rel=0.1)


@pytest.mark.parametrize("gain", [0.8, 1.15])
def test_a_change_of_the_light_is_no_wear(reference: np.ndarray, gain: float) -> None:
    worn = share(reference, [p * np.float32(gain) for p in pictures(0, FRAMES)])
    assert worn is not None
    assert worn < 0.001


def test_a_change_counts_once_it_is_in_most_observations(reference: np.ndarray) -> None:
    fresh, marred = pictures(0, FRAMES), pictures(50, FRAMES)
    assert (share(reference, fresh[:3] + marred[:2]) or 0) < 0.01
    assert (share(reference, fresh[:2] + marred[:3]) or 0) > 0.04


def test_wear_that_is_repaired_is_forgotten(reference: np.ndarray) -> None:
    wear = WearMap(reference, 255.0)
    fresh, marred = pictures(0, FRAMES), pictures(50, FRAMES)
    for pixels in 3 * marred:
        wear.add(pixels)
    assert (wear.share or 0) > 0.04
    for _ in range(WEAR.window):
        wear.add(fresh[0])
    assert (wear.share or 0) < 0.01


def test_what_is_hidden_is_not_judged(reference: np.ndarray) -> None:
    wear = WearMap(reference, 255.0)
    left = np.zeros_like(
        pictures()[0][wear.stride // 2 :: wear.stride, wear.stride // 2 :: wear.stride, 0], bool
    )
    left[:, : left.shape[1] // 3] = True
    for pixels in pictures(0, FRAMES):
        touched = pixels.copy()
        touched[:, : touched.shape[1] // 3] //= 2
        wear.add(touched, left)
    assert (wear.share or 0) < 0.001
    hidden = np.ones_like(left)
    other = WearMap(reference, 255.0)
    for pixels in pictures(0, FRAMES):
        other.add(pixels, hidden)
    assert other.share is None


def test_too_few_observations_give_no_share(reference: np.ndarray) -> None:
    assert share(reference, pictures(0, FRAMES)[:-1]) is None


def test_markers_of_the_reference_are_no_wear(reference: np.ndarray) -> None:
    """A marker that has moved leaves bright gel where the reference is dark."""
    mask = np.zeros(reference.shape[:2], bool)
    mask[:, 200:260] = True
    with_marker = np.where(mask[..., None], reference * 0.6, reference).astype(np.float32)
    assert (share(with_marker, pictures(0, FRAMES)) or 0) > 0.05
    assert (share(with_marker, pictures(0, FRAMES), marker_mask=mask) or 0) < 0.001
