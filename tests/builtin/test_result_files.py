"""Files that the built-in sinks write for a reading."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.normals import read_normals
from support.readings import ONES, SHAPE, contact, height, markers, reading, saved, shear, slopes

from tactile_core.errors import InputError
from tactile_core.formats.images import read_image
from tactile_core.formats.npz import DESCRIPTION, read_npz
from tactile_core.formats.tmd import read_tmd
from tactile_core.quantities import Gradients, HeightMap, Quantity
from tactile_core.recordings.output_folder import WRITTEN, OutputFolder

ALL = ("npz", "tmd", "png", "ply")


def test_each_sink_writes_its_files_under_the_observation_s_name(tmp_path: Path) -> None:
    full = reading(slopes(), height(), contact())
    written = saved(full, tmp_path / "out", ALL)
    expected = {f"press.v1.{name}" for name in ALL} | {"press.v1_normals.png"}
    assert {path.name for path in written} == expected
    assert {path.name for path in (tmp_path / "out").iterdir()} == expected | {WRITTEN}
    assert read_tmd(tmp_path / "out/press.v1.tmd").height_mm == pytest.approx(0.5)
    assert read_image(tmp_path / "out/press.v1.png").ndim == 3
    normals = read_normals(tmp_path / "out/press.v1_normals.png")
    np.testing.assert_allclose(normals, full[Gradients].normals, atol=2e-5)


def test_the_npz_holds_every_array_with_its_type(tmp_path: Path) -> None:
    holes = ONES.copy()
    holes[0, 0] = False
    full = reading(slopes(), height(valid=holes), contact())
    (path,) = saved(full, tmp_path, ["npz"])
    arrays = read_npz(path)
    assert {n: (a.shape, a.dtype.name) for n, a in arrays.items() if n != DESCRIPTION} == {
        "height_mm": (SHAPE, "float32"),
        "gradients": ((*SHAPE, 2), "float32"),
        "gradients_valid": (SHAPE, "bool"),
        "contact": (SHAPE, "bool"),
        "valid": (SHAPE, "bool"),
        "mm_per_px": ((), "float64"),
        "timestamp_s": ((), "float64"),
    }
    np.testing.assert_array_equal(arrays["valid"], holes)  # of the height, not of the gradients


def test_everything_is_finite_and_holes_are_marked(tmp_path: Path) -> None:
    mm = height().mm.copy()
    mm[2, 3] = np.nan
    gx = np.zeros(SHAPE, np.float32)
    gx[4, 5] = np.inf
    broken = reading(Gradients(gx, np.zeros_like(gx), ONES, 0.1), HeightMap(mm, ONES, 0.1))
    saved(broken, tmp_path, ALL)
    arrays = read_npz(tmp_path / "press.v1.npz")
    assert all(np.isfinite(a).all() for a in arrays.values())
    assert np.argwhere(~arrays["valid"]).tolist() == [[2, 3]]
    assert np.argwhere(~arrays["gradients_valid"]).tolist() == [[4, 5]]
    assert np.isfinite(read_tmd(tmp_path / "press.v1.tmd").height_mm).all()
    assert read_normals(tmp_path / "press.v1_normals.png")[4, 5, 2] == pytest.approx(1)


def test_without_a_height_no_height_files_are_written(tmp_path: Path) -> None:
    (path,) = saved(reading(contact()), tmp_path, ALL)
    assert {"contact", "mm_per_px"} < set(read_npz(path))


def test_a_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("here already")
    with pytest.raises(InputError, match="is a file"):
        saved(reading(), tmp_path / "file", ["npz"])


@pytest.mark.parametrize(
    "source",
    [
        "../../escaped",
        "/tmp/escaped",
        "..",
        ".",
        "a/b",
        "a\\b",
        "a\0b",
        "a\nb\x1b[2J",
        "x" * 300,
        "é" * 200,
        "\ud800",
        os.fsdecode(b"ball\xff"),
        os.fsdecode(b"\xff" * 300),
    ],
    ids=ascii,
)
def test_no_observation_name_escapes_the_folder(tmp_path: Path, source: str) -> None:
    written = saved(
        reading(slopes(), height(), markers(), source=source), tmp_path / "in" / "out", ALL
    )
    assert len(written) == 5
    assert {path.parent for path in written} == {tmp_path / "in" / "out"}
    assert all(path.is_file() for path in written)
    assert [path.name for path in tmp_path.iterdir()] == ["in"]


def test_a_result_never_replaces_that_of_another_observation(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "out")
    saved(reading(slopes(), source="a"), folder, ["png"])
    before = (tmp_path / "out" / "a_normals.png").read_bytes()
    with pytest.raises(InputError, match=r"a_normals.png was written for a in this run .* for a_n"):
        saved(reading(height(), source="a_normals"), folder, ["png"])
    assert (tmp_path / "out" / "a_normals.png").read_bytes() == before


def test_a_reading_is_written_again_over_its_own_files_alone(tmp_path: Path) -> None:
    for fill in (0.1, 0.2):
        saved(reading(height(fill)), tmp_path, ["npz", "tmd"])
    assert read_tmd(tmp_path / "press.v1.tmd").height_mm == pytest.approx(0.2)
    (tmp_path / "press.v1.tmd").write_bytes(b"my own")
    with pytest.raises(InputError, match=r"press\.v1\.tmd already exists"):
        saved(reading(height()), tmp_path, ["tmd"])
    assert (tmp_path / "press.v1.tmd").read_bytes() == b"my own"


@pytest.mark.parametrize(
    "quantities",
    [(markers(),), (shear(),), (markers(), shear()), (height(), markers(), shear())],
)
def test_a_picture_shows_how_the_surface_is_sheared_with_and_without_height(
    tmp_path: Path, quantities: tuple[Quantity, ...]
) -> None:
    (written,) = saved(reading(*quantities), tmp_path, ["png"])
    assert written.name == "press.v1.png"
    assert max(read_image(written).shape) >= 640


def test_markers_and_field_are_saved_under_the_names_of_the_contract(tmp_path: Path) -> None:
    (written,) = saved(reading(markers(), shear()), tmp_path, ["npz"])
    arrays: dict[str, Any] = read_npz(written)
    assert arrays["displacement_mm"].shape == (*SHAPE, 2)
    np.testing.assert_allclose(arrays["marker_displacement_mm"], 0.1, atol=1e-6)
    assert arrays["marker_seen"].tolist() == [True, False]
