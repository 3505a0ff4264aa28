"""The contents of a bundle, and the check of the sensor that it belongs to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_core.algorithms.arrays.regression import PolynomialFit
from tactile_core.builtin.lookup_table import Polynomial
from tactile_core.bundles.bundle import Bundle, Manifest
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.slope_models.slope_model import SlopeModel
from tactile_core.profiles.loader import profile_hash
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference

WIDTH, HEIGHT, MM_PER_PX = 16, 12, 0.1
CHANNELS = "red", "green", "blue"


def profile(*, red_deg: float = 0.0, **image: Any) -> Profile:
    size = {"width_px": WIDTH, "height_px": HEIGHT, "mm_per_px": MM_PER_PX, "bit_depth": 12}
    places = zip(CHANNELS, (red_deg, 120.0, 240.0), strict=True)
    lights = [{"name": name, "azimuth_deg": azimuth} for name, azimuth in places]
    return Profile.model_validate(
        {
            "schema": 1,
            "name": "kept",
            "image": size | image,
            "illumination": {"use": "core.constant", "lights": lights},
        }
    )


@pytest.fixture
def bundle() -> Bundle:
    rng = np.random.default_rng(0)
    fit = PolynomialFit(
        np.zeros(5, np.float32), np.ones(5, np.float32), rng.random((6, 2), np.float32), order=1
    )
    reference = Reference(
        pixels=4000 * rng.random((HEIGHT, WIDTH, 3), np.float32),
        channels=CHANNELS,
        full_scale=4095.0,
        marker_mask=rng.random((HEIGHT, WIDTH)) < 0.2,
        noise=3.25,
        frames=7,
    )
    manifest = Manifest(
        profile="kept",
        serial="0007",
        artefacts={"light": "core.polynomial"},
        image_size_px=(WIDTH, HEIGHT),
        channels=CHANNELS,
        mm_per_px=MM_PER_PX,
        bit_depth=12,
        profile_hash=profile_hash(profile()),
    )
    light = Polynomial(SlopeModel(fit, (HEIGHT, WIDTH, 3), 1.5))
    return Bundle(manifest, {"light": light}, reference)


def test_the_reference_is_stored_completely(bundle: Bundle, tmp_path: Path) -> None:
    bundle.save(tmp_path / "kept")
    before, after = bundle.reference, Bundle.load(tmp_path / "kept").reference
    np.testing.assert_array_equal(after.pixels, before.pixels)
    assert after.pixels.dtype == before.pixels.dtype
    assert before.marker_mask is not None
    assert after.marker_mask is not None
    np.testing.assert_array_equal(after.marker_mask, before.marker_mask)
    for name in ("channels", "full_scale", "noise", "frames", "relative"):
        assert getattr(after, name) == getattr(before, name)


def test_an_unmarked_reference_comes_back_unmarked(bundle: Bundle, tmp_path: Path) -> None:
    bare = Reference(bundle.reference.pixels, CHANNELS)
    replace(bundle, reference=bare).save(tmp_path / "kept")
    assert Bundle.load(tmp_path / "kept").reference.marker_mask is None


@pytest.mark.parametrize("changed", ["reference.npz", "light/model.npz"])
def test_changed_arrays_are_refused(bundle: Bundle, tmp_path: Path, changed: str) -> None:
    bundle.save(tmp_path / "kept")
    path = tmp_path / "kept" / changed
    with np.load(path) as data:
        arrays = dict(data)
    name = "pixels" if "pixels" in arrays else "coefficients"
    np.savez(path, **arrays | {name: arrays[name] * np.float32(1.01)})
    with pytest.raises(CalibrationError):
        Bundle.load(tmp_path / "kept")


def test_the_sensor_that_it_was_made_for_is_accepted(bundle: Bundle) -> None:
    assert bundle.check(profile(), "0007") == []


@pytest.mark.parametrize("factor", [0.5, 0.98, 1.02, 2.0])
def test_larger_and_smaller_pixels_are_refused(bundle: Bundle, factor: float) -> None:
    with pytest.raises(CalibrationError, match="mm per pixel"):
        bundle.check(profile(mm_per_px=factor * MM_PER_PX))


def test_swapped_width_and_height_are_refused(bundle: Bundle) -> None:
    with pytest.raises(CalibrationError, match="image size 16 × 12, not 12 × 16"):
        bundle.check(profile(width_px=HEIGHT, height_px=WIDTH))


def test_a_changed_light_direction_is_a_warning(bundle: Bundle) -> None:
    notes = bundle.check(profile(red_deg=60.0), "0007")
    assert len(notes) == 1
    assert "has changed since" in notes[0]
