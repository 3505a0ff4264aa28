"""Taxim's table is read backwards, and one of our calibrations is written for its simulators."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.colour_profile import colour_profile
from support.command_line import refused, tactile
from support.virtual_lab import VirtualLab

from tactile_core import Bundle, Frame, InputError, Reference
from tactile_core.calibration.imported import import_calibration
from tactile_core.calibration.presses import angles_deg
from tactile_imports.polynomial_lookup import PolynomialLookup, TaximImporter, TaximRgbImporter
from tactile_imports.polynomial_table import read_table, write_table
from tactile_imports.table_of_bundle import table_of

Array = np.ndarray[Any, Any]

HEIGHT, WIDTH = 60, 80
CHANNELS = ("red", "green", "blue")
BINS = 45
# [rad] Towards which slopes each channel becomes brighter
LIGHTS = np.radians([90.0, 210.0, 330.0])


def write_polycalib(path: Path, *, blue_first: bool = True) -> Path:
    """Write the table of three lights that are brighter at one side of the image."""
    middle = np.arange(BINS) + 0.5
    tilt = (middle * np.pi / 2 / (BINS - 1))[:, None]
    direction = middle * 2 * np.pi / (BINS - 1) - np.pi
    tables = []
    for azimuth in LIGHTS:
        constant = 80 * np.sin(tilt) * np.cos(direction - azimuth) - 30 * (1 - np.cos(tilt))
        terms = np.zeros((BINS, BINS, 6))
        terms[..., 5], terms[..., 3] = constant, constant / (4 * WIDTH)
        tables.append(terms)
    names = ("grad_b", "grad_g", "grad_r") if blue_first else ("grad_r", "grad_g", "grad_b")
    np.savez(path, bins=BINS, **dict(zip(names, tables, strict=True)))
    return path


def rendered(path: Path, gx: Array, gy: Array, background_bgr: Array) -> Array:
    """Return the image (H, W, 3) in blue, green, red that Taxim renders of some slopes."""
    with np.load(path) as data:
        steps = int(data["bins"]) - 1
        tilt = np.arctan(np.hypot(gx, gy))
        direction = np.arctan2(gy, gx)
        row = np.floor(tilt / (0.5 * np.pi / steps)).astype(int)
        column = np.floor((direction + np.pi) / (2 * np.pi / steps)).astype(int)
        y, x = np.indices(gx.shape)
        terms = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=-1)
        planes = [(terms * data[f"grad_{name}"][row, column]).sum(axis=-1) for name in "rgb"]
        return np.asarray(np.stack(planes, axis=-1) + background_bgr)


def ball(
    shape: tuple[int, int], centre: tuple[float, float], radius: float, inside: float
) -> Array:
    """Return slopes (H, W, 2) of a ball of this radius in px within a distance of its middle."""
    y, x = np.indices(shape, float)
    away = np.stack([x - centre[0], y - centre[1]], axis=-1)
    square = (away**2).sum(axis=-1, keepdims=True)
    slopes = -away / np.sqrt(np.maximum(radius**2 - square, 1))
    return np.where(square < inside**2, slopes, 0)


def measured(model: PolynomialLookup, image_bgr: Array, background_bgr: Array) -> Array:
    frame = Frame(np.ascontiguousarray(image_bgr[..., ::-1], np.float32), CHANNELS, 0.1)
    reference = Reference(np.ascontiguousarray(background_bgr[..., ::-1], np.float32), CHANNELS)
    gradients = model.measure(frame, reference)
    return np.stack([gradients.x, gradients.y], axis=-1)


def test_an_image_that_taxim_renders_gives_the_slopes_that_it_was_rendered_of(
    tmp_path: Path,
) -> None:
    path = write_polycalib(tmp_path / "polycalib.npz")
    slopes = ball((HEIGHT, WIDTH), (44, 27), radius=40, inside=22)
    background = np.full((HEIGHT, WIDTH, 3), 120.0)
    image = rendered(path, slopes[..., 0], slopes[..., 1], background)
    model = TaximImporter().read(path, colour_profile(tmp_path, WIDTH, HEIGHT, 0.1))
    found = measured(model, image, background)
    pressed = slopes.any(axis=-1)
    errors = angles_deg(found[pressed], slopes[pressed])
    # half a bin of tilt and of direction, which is an angle in proportion to the tilt
    assert errors.max() < 0.5 * 90 / (BINS - 1) + 0.5 * 360 / (BINS - 1) * np.sin(np.arctan(0.7))
    assert errors.mean() < 2
    # Taxim renders level gel as of its first bin
    assert np.hypot(*found[~pressed].T).max() < np.tan(np.pi / 2 / (BINS - 1))
    assert not measured(model, background, background).any()


def test_the_nearest_colour_of_all_is_found(tmp_path: Path) -> None:
    path = write_polycalib(tmp_path / "polycalib.npz")
    model = TaximImporter().read(path, colour_profile(tmp_path, WIDTH, HEIGHT, 0.1))
    rng = np.random.default_rng(0)
    background = np.full((HEIGHT, WIDTH, 3), 120.0)
    image = background + rng.normal(0, 25, background.shape)
    found = measured(model, image, background)
    table = read_table(path, "bgr")
    candidates = table.slopes()[: BINS - 8].reshape(-1, 2)
    for y, x in rng.integers((0, 0), (HEIGHT, WIDTH), (40, 2)):
        expected = table.change_at(x, y)[: BINS - 8].reshape(-1, 3)
        observed = (image - background)[y, x, ::-1]
        distance = np.linalg.norm(np.vstack([expected, np.zeros(3)]) - observed, axis=1)
        chosen = np.linalg.norm(np.vstack([candidates, np.zeros(2)]) - found[y, x], axis=1).argmin()
        assert distance[chosen] <= distance.min() + 0.1


def test_the_order_of_isaac_lab_is_red_first(tmp_path: Path) -> None:
    blue = read_table(write_polycalib(tmp_path / "a.npz"), "bgr")
    red = read_table(write_polycalib(tmp_path / "b.npz", blue_first=False), "rgb")
    np.testing.assert_array_equal(red.coefficients, blue.coefficients)
    models = (
        TaximImporter().read(tmp_path / "a.npz", colour_profile(tmp_path, WIDTH, HEIGHT, 0.1)),
        TaximRgbImporter().read(tmp_path / "b.npz", colour_profile(tmp_path, WIDTH, HEIGHT, 0.1)),
    )
    np.testing.assert_array_equal(models[0].table.coefficients, models[1].table.coefficients)


def test_a_bundle_measures_as_the_table_that_it_was_made_of(tmp_path: Path) -> None:
    path = write_polycalib(tmp_path / "polycalib.npz")
    model = TaximImporter().read(path, colour_profile(tmp_path, WIDTH, HEIGHT, 0.1))
    model.save(tmp_path)
    again = PolynomialLookup.load(tmp_path)
    rng = np.random.default_rng(0)
    both = rng.uniform(80, 160, (2, HEIGHT, WIDTH, 3))
    np.testing.assert_array_equal(measured(again, *both), measured(model, *both))


def test_a_table_is_written_as_it_was_read(tmp_path: Path) -> None:
    path = write_polycalib(tmp_path / "polycalib.npz")
    write_table(tmp_path / "again.npz", read_table(path, "bgr"), "bgr")
    with np.load(path) as one, np.load(tmp_path / "again.npz") as other:
        assert set(one.files) == set(other.files)
        for name in one.files:
            np.testing.assert_array_equal(one[name], other[name])


ZEROS = np.zeros((BINS, BINS, 6))


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"grad_r": ZEROS[:-1]}, r"grad_r .* is \(44, 45, 6\), not \(45, 45, 6\) as for 45 bins"),
        ({"grad_b": ZEROS[..., :3]}, r"grad_b .* is \(45, 45, 3\), not \(45, 45, 6\)"),
        ({"grad_g": np.full_like(ZEROS, np.inf)}, "grad_g .* holds no finite numbers"),
        ({"bins": np.array(1.5)}, "bins .* is no whole number"),
        ({"bins": np.array(1)}, "not .1, 1, 6. as for 1 bins"),
        ({"grad_r": None}, "has no grad_r; give the polycalib.npz of Taxim"),
    ],
)
def test_a_table_of_another_size_is_one_sentence(
    tmp_path: Path, arrays: dict[str, Array | None], said: str
) -> None:
    whole = {"bins": np.array(BINS), "grad_r": ZEROS, "grad_g": ZEROS, "grad_b": ZEROS}
    kept = {name: array for name, array in (whole | arrays).items() if array is not None}
    save: Any = np.savez
    save(tmp_path / "other.npz", **kept)
    with pytest.raises(InputError, match=said) as refusal:
        TaximImporter().read(tmp_path / "other.npz", colour_profile(tmp_path, WIDTH, HEIGHT, 0.1))
    assert "\n" not in str(refusal.value)


def test_an_exported_unit_is_rendered_as_its_own_calibration_sees_it(
    lab: VirtualLab, tmp_path: Path
) -> None:
    file = tmp_path / "polycalib.npz"
    done = tactile("export", lab.bundle, "--as", "taxim", "--out", file, "--json")
    assert json.loads(done.stdout) == {"file": str(file), "kind": "taxim", "bins": 125}
    bundle = Bundle.load(lab.bundle)
    assert bundle.reference is not None
    assert bundle.calibration is not None
    shape = bundle.reference.pixels.shape[:2]
    slopes = ball(shape, (shape[1] / 2, shape[0] / 2), radius=40, inside=15)
    image = rendered(file, slopes[..., 0], slopes[..., 1], bundle.reference.pixels[..., ::-1])
    pixels = np.rint(np.clip(image[..., ::-1], 0, 255)).astype(np.uint8)
    gradients = bundle.calibration.measure(
        Frame(pixels, CHANNELS, bundle.manifest.mm_per_px), bundle.reference
    )
    found = np.stack([gradients.x, gradients.y], axis=-1)
    y, x = np.indices(shape)
    inside = np.hypot(x - shape[1] / 2, y - shape[0] / 2) < 10
    assert angles_deg(found[inside], slopes[inside]).mean() < 2.5
    assert angles_deg(0 * slopes[inside], slopes[inside]).mean() > 8
    # and the table, imported again, agrees with the model that it was made of
    again = import_calibration(file, "imports.taxim", lab.profile_path, reference=lab.reference)
    assert again.calibration is not None
    back = again.calibration.measure(
        Frame(pixels, CHANNELS, bundle.manifest.mm_per_px), bundle.reference
    )
    assert angles_deg(np.stack([back.x, back.y], axis=-1)[inside], slopes[inside]).mean() < 2.5


def test_red_comes_first_for_isaac_lab(lab: VirtualLab, tmp_path: Path) -> None:
    table = table_of(Bundle.load(lab.bundle))
    done = tactile("export", lab.bundle, "--as", "taxim_rgb", "--out", tmp_path / "a.npz")
    assert "125 tilts × 125 directions, as taxim_rgb" in done.stdout
    np.testing.assert_allclose(
        read_table(tmp_path / "a.npz", "rgb").coefficients, table.coefficients, rtol=1e-6
    )


def test_a_model_that_has_no_colours_for_a_slope_is_not_exported(
    lab: VirtualLab, tmp_path: Path
) -> None:
    file = write_polycalib(tmp_path / "polycalib.npz")
    words = ("import", file, "--as", "imports.taxim", "--profile", lab.profile_path)
    assert tactile(*words, "--out", tmp_path / "bundle").returncode == 0
    said = refused("export", tmp_path / "bundle", "--as", "taxim", "--out", tmp_path / "x.npz")
    assert "imports.polynomial_lookup, does not say which colours a slope has" in said
    assert said.count("\n") == 1
    assert not (tmp_path / "x.npz").exists()


@pytest.mark.recordings
def test_the_table_of_a_real_mini_is_read_backwards(recordings: Path, tmp_path: Path) -> None:
    file = recordings / "calibrations" / "taxim_mini_polycalib.npz"
    if not file.exists():
        pytest.skip(f"{file} is missing; it is the polycalib.npz of a GelSight Mini")
    slopes = ball((240, 320), (150, 120), radius=50, inside=38)
    background = np.full((240, 320, 3), 120.0)
    image = rendered(file, slopes[..., 0], slopes[..., 1], background)
    pressed = (slopes**2).sum(axis=-1) > np.tan(np.radians(3)) ** 2
    # where nothing touches, nothing changes; the table is of pressed gel
    image = np.where(pressed[..., None], image, background)
    found = measured(
        TaximImporter().read(file, colour_profile(tmp_path, 320, 240, 0.1)), image, background
    )
    errors = angles_deg(found[pressed], slopes[pressed])
    assert np.median(errors) < 1
    assert errors.mean() < 2
    np.testing.assert_allclose(found[~pressed], 0, atol=1e-6)
