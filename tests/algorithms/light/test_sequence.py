"""The broad pattern of each light identifies its exposure, whatever the contact or drift."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_core.algorithms.light.sequence import SequenceFault, faults, pattern

LIGHTS = 6
PAIRS = [(i, j) for i in range(LIGHTS) for j in range(LIGHTS) if i != j]


def scan(folder: Path, first: int) -> np.ndarray:
    reading = cv2.IMREAD_REDUCED_GRAYSCALE_4 if first == 7 else cv2.IMREAD_GRAYSCALE
    images = [cv2.imread(str(folder / f"image{first + k:02d}.png"), reading) for k in range(LIGHTS)]
    size = (612, 512)
    return np.dstack([cv2.resize(i, size, interpolation=cv2.INTER_AREA) for i in images])


def smooth(pixels: np.ndarray) -> np.ndarray:
    """Fit a quadratic in place of a reference image that was not recorded."""
    y, x = np.mgrid[-1 : 1 : pixels.shape[0] * 1j, -1 : 1 : pixels.shape[1] * 1j]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    sampled = terms[::8, ::8].reshape(-1, 6)
    logs = np.log(pixels[::8, ::8].reshape(-1, LIGHTS) + 1.0)
    return np.exp(terms @ np.linalg.lstsq(sampled, logs, rcond=None)[0])


@pytest.fixture(scope="module", params=["BGA-001", "BGA-002", "groove"])
def real(request: pytest.FixtureRequest, recordings: Path) -> tuple[np.ndarray, np.ndarray]:
    """An observation full of contact, and the reference."""
    six_led = recordings / "six_led"
    if request.param == "groove":
        touched = scan(six_led / "groove", 1)
        return touched, smooth(touched)
    grids = six_led / "ball_grid"
    return scan(grids / request.param, 7), scan(grids / "Flat-001", 7).astype(float)


def again(image: np.ndarray, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, 1.5, image.shape)
    return np.clip(np.round(image + noise), 0, 255).astype(np.uint8)


def test_a_real_observation_is_good(real: tuple[np.ndarray, np.ndarray]) -> None:
    touched, undeformed = real
    assert faults(pattern(touched, 255), pattern(undeformed, 255)) == ()
    assert faults(pattern(touched, 255)) == ()


def test_every_swap_is_reported(real: tuple[np.ndarray, np.ndarray]) -> None:
    touched, undeformed = real
    reference = pattern(undeformed, 255)
    for i, j in PAIRS:
        swapped = touched.copy()
        swapped[..., [i, j]] = touched[..., [j, i]]
        assert set(faults(pattern(swapped, 255), reference)) == {
            SequenceFault(i, j),
            SequenceFault(j, i),
        }


def test_every_repeated_exposure_is_reported(real: tuple[np.ndarray, np.ndarray]) -> None:
    touched, undeformed = real
    reference = pattern(undeformed, 255)
    for i, j in PAIRS:
        repeated = touched.copy()
        repeated[..., i] = again(touched[..., j], seed=i)
        assert faults(pattern(repeated, 255), reference) == (SequenceFault(i, j),)
        (alone,) = faults(pattern(repeated, 255))
        assert {alone.exposure, alone.shows} == {i, j}
        assert not alone.certain


@pytest.mark.parametrize("late", range(1, LIGHTS))
def test_a_late_sequence_is_reported(late: int, real: tuple[np.ndarray, np.ndarray]) -> None:
    touched, undeformed = real
    found = faults(pattern(np.roll(touched, late, axis=2), 255), pattern(undeformed, 255))
    assert found == tuple(SequenceFault(k, (k - late) % LIGHTS) for k in range(LIGHTS))


@pytest.mark.parametrize("missing", range(LIGHTS))
@pytest.mark.parametrize("level", [0.0, 0.04, 0.2])
def test_every_dark_exposure_is_reported(
    missing: int, level: float, real: tuple[np.ndarray, np.ndarray]
) -> None:
    touched, undeformed = real
    dark = touched.copy()
    dark[..., missing] = again(level * touched[..., missing], seed=missing)
    for reference in (pattern(undeformed, 255), None):
        assert faults(pattern(dark, 255), reference) == (SequenceFault(missing, None),)


def test_good_observations_are_never_refused(real: tuple[np.ndarray, np.ndarray]) -> None:
    touched, undeformed = real
    contact = (touched + 1) / (undeformed + 1)
    for seed in range(34):
        rng = np.random.default_rng(seed)
        turned = (contact, contact[::-1], contact[:, ::-1], contact**1.2)[seed % 4]
        seen = undeformed * turned * rng.uniform(0.95, 1.05, LIGHTS) * rng.uniform(0.7, 1.3)
        seen = np.roll(seen, rng.integers(-8, 9, 2), axis=(0, 1))
        top, left = rng.integers(0, 128), rng.integers(0, 153)
        part = (slice(top, top + 384), slice(left, left + 459)) if seed % 2 else (slice(None),) * 2
        good = pattern(again(seen[part], seed), 255)
        assert faults(good, pattern(undeformed[part], 255)) == ()
        assert faults(good) == ()
