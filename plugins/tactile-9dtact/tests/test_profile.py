"""The profile is the published sensor, and its lens the published rectification."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.command_line import tactile

from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.profiles.loader import load_profile

PROFILE = load_profile("9dtact")


def test_the_view_is_that_of_the_authors() -> None:
    image = PROFILE.image
    assert (image.width_px, image.height_px) == (460, 345)
    assert image.width_px * image.mm_per_px == pytest.approx(23.5, abs=0.1)


def test_what_is_not_published_is_left_out() -> None:
    assert PROFILE.gel.thickness_mm is None
    assert PROFILE.gel.shear_modulus_mpa is None
    assert "product" not in PROFILE.camera.options


def test_the_lens_and_the_warp_rectify_as_the_authors_tables(recordings: Path) -> None:
    folder = recordings / "ninedtact" / "sensor_1" / "camera_calibration"
    if not folder.exists():
        pytest.skip(f"{folder} is missing; it is a sensor's folder of 9DTact")
    rows, columns = (np.load(folder / f"{name}_index.npy") for name in ("row", "col"))
    row, column, scale = np.load(folder / "position_scale.npy")
    assert PROFILE.image.mm_per_px == pytest.approx(scale, rel=1e-3)
    top, left = int(row - 345 / 2), int(column - 460 / 2)
    # a picture of positions shows from where each pixel of the rectified image comes
    y, x = np.indices((480, 640), np.uint16)
    geometry = ImageGeometry(PROFILE.image.model_copy(update={"bit_depth": 16}))
    found = geometry.apply(np.dstack([x, y, x]) * 64) / 64
    true = np.stack([columns, rows], axis=-1)[top : top + 345, left : left + 460]
    seen = true.any(axis=2)
    away = np.hypot(*(found[..., :2] - true)[seen].T)
    assert np.median(away) < 1.5
    assert np.percentile(away, 95) < 4.5


def test_the_virtual_sensor_needs_no_device() -> None:
    done = tactile("run", "9dtact", "--sim", "--frames", 3, "--json")
    assert done.returncode == 0, done.stderr
    assert [json.loads(line)["sequence"] for line in done.stdout.splitlines()] == [0, 1, 2]
