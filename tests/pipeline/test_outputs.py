"""What a reading leaves on disk."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.images import read_image
from tactile_core.formats.normals import read_normals
from tactile_core.formats.npz import read_npz
from tactile_core.formats.tmd import read_tmd
from tactile_core.pipeline.outputs import FORMATS, check_names, safe_stem, write_reading
from tactile_core.pipeline.reading import Reading
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    Gradients,
    HeightMap,
    MarkerField,
    Quantity,
)
from tactile_core.recordings.output_folder import WRITTEN, OutputFolder

SHAPE = (6, 8)
ONES = np.ones(SHAPE, bool)


def reading(*quantities: Quantity, source: str = "press.v1") -> Reading:
    frame = Frame(np.zeros((*SHAPE, 3), np.uint8), ("r", "g", "b"), 0.1, source=source)
    return Reading(frame, {type(q): q for q in quantities}, {})


def slopes(fill: float = 0.1) -> Gradients:
    return Gradients(np.full(SHAPE, fill, np.float32), np.zeros(SHAPE, np.float32), ONES, 0.1)


def height(fill: float = 0.5, valid: Any = ONES) -> HeightMap:
    return HeightMap(np.full(SHAPE, fill, np.float32), valid, 0.1)


def test_each_format_writes_its_files_under_the_observation_s_name(tmp_path: Path) -> None:
    full = reading(slopes(), height(), ContactMask(ONES, 0.1))
    written = write_reading(full, tmp_path / "out", FORMATS)
    names = ["npz", "tmd", "png", "ply"]
    expected = {f"press.v1.{name}" for name in names} | {"press.v1_normals.png"}
    assert {path.name for path in written} == expected
    assert {path.name for path in (tmp_path / "out").iterdir()} == expected | {WRITTEN}
    assert read_tmd(tmp_path / "out/press.v1.tmd").height_mm == pytest.approx(0.5)
    assert read_image(tmp_path / "out/press.v1.png").ndim == 3
    normals = read_normals(tmp_path / "out/press.v1_normals.png")
    np.testing.assert_allclose(normals, full[Gradients].normals, atol=2e-5)


def test_the_npz_holds_every_array_with_its_type(tmp_path: Path) -> None:
    holes = ONES.copy()
    holes[0, 0] = False
    full = reading(slopes(), height(valid=holes), ContactMask(ONES, 0.1))
    (path,) = write_reading(full, tmp_path, ["npz"])
    arrays = read_npz(path)
    assert {name: (a.shape, a.dtype.name) for name, a in arrays.items()} == {
        "height_mm": (SHAPE, "float32"),
        "gradients": ((*SHAPE, 2), "float32"),
        "contact": (SHAPE, "bool"),
        "valid": (SHAPE, "bool"),
        "mm_per_px": ((), "float64"),
    }
    np.testing.assert_array_equal(arrays["valid"], holes)  # the height's, not the gradients'


def test_everything_is_finite_and_holes_are_marked(tmp_path: Path) -> None:
    bad = height()
    mm = bad.mm.copy()
    mm[2, 3] = np.nan
    gx = np.zeros(SHAPE, np.float32)
    gx[4, 5] = np.inf
    broken = reading(Gradients(gx, 0 * mm, ONES, 0.1), HeightMap(mm, ONES, 0.1))
    with np.errstate(invalid="ignore"):
        write_reading(broken, tmp_path, FORMATS)
    arrays = read_npz(tmp_path / "press.v1.npz")
    assert all(np.isfinite(a).all() for a in arrays.values())
    assert not arrays["valid"][2, 3]
    assert not arrays["valid"][4, 5]
    assert arrays["valid"].sum() == 48 - 2
    assert np.isfinite(read_tmd(tmp_path / "press.v1.tmd").height_mm).all()
    assert read_normals(tmp_path / "press.v1_normals.png")[4, 5, 2] == pytest.approx(1)


def test_what_cannot_be_written_without_a_height_is_left_out(tmp_path: Path) -> None:
    (path,) = write_reading(reading(ContactMask(ONES, 0.1)), tmp_path, FORMATS)
    assert sorted(read_npz(path)) == ["contact", "mm_per_px"]


@dataclass(frozen=True, eq=False)
class Rival(Quantity):
    """A stranger's quantity that uses one of our names, and one of its own."""

    def arrays(self) -> Mapping[str, np.ndarray]:
        return {"height_mm": np.array(7.0), "peak": np.array(1)}


def test_a_stranger_s_array_is_stored_and_never_replaces_ours(tmp_path: Path) -> None:
    (path,) = write_reading(reading(Rival(), height()), tmp_path, ["npz"])
    arrays = read_npz(path)
    assert arrays["height_mm"].shape == SHAPE
    assert arrays["Rival.height_mm"] == 7.0
    assert arrays["peak"] == 1


def test_unusable_places_and_formats_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'jpg' is no output format"):
        write_reading(reading(), tmp_path, ["npz", "jpg"])
    (tmp_path / "file").write_text("here already")
    with pytest.raises(InputError, match="is a file"):
        write_reading(reading(), tmp_path / "file", ["npz"])


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
def test_no_name_of_an_observation_leads_out_of_the_folder(tmp_path: Path, source: str) -> None:
    full = reading(slopes(), height(), marks(), source=source)
    written = write_reading(full, tmp_path / "in" / "out", FORMATS)
    assert len(written) == 5
    assert {path.parent for path in written} == {tmp_path / "in" / "out"}
    assert all(path.is_file() for path in written)
    assert [path.name for path in tmp_path.iterdir()] == ["in"]


def test_names_that_had_to_be_changed_stay_apart() -> None:
    sources = ["a/b", "a_b", "a\\b", "x" * 300, "x" * 301, "..", "."]
    assert len({safe_stem(source) for source in sources}) == len(sources)
    assert safe_stem("press.v1") == "press.v1"


def test_results_of_two_observations_never_take_one_name(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "out")
    with pytest.raises(InputError, match=r"results of a and of a_normals would both be a_normals"):
        check_names(folder, ["a", "a_normals"], ["png"])
    with pytest.raises(InputError, match=r"results of twice and of twice would both be twice.npz"):
        check_names(folder, ["twice", "twice"], ["npz"])
    check_names(folder, ["a", "a_normals"], ["npz", "tmd"])
    assert not folder.path.exists()
    write_reading(reading(slopes(), source="a"), folder, ["png"])
    before = (tmp_path / "out" / "a_normals.png").read_bytes()
    with pytest.raises(InputError, match=r"a_normals.png was written for a in this run .* for a_n"):
        write_reading(reading(height(), source="a_normals"), folder, ["png"])
    assert (tmp_path / "out" / "a_normals.png").read_bytes() == before


def test_a_reading_is_written_again_over_its_own_files_alone(tmp_path: Path) -> None:
    for fill in (0.1, 0.2):
        write_reading(reading(height(fill)), tmp_path, ["npz", "tmd"])
    assert read_tmd(tmp_path / "press.v1.tmd").height_mm == pytest.approx(0.2)
    (tmp_path / "press.v1.tmd").write_bytes(b"my own")
    with pytest.raises(InputError, match=r"press\.v1\.tmd is there already"):
        write_reading(reading(height()), tmp_path, ["tmd"])
    with pytest.raises(InputError, match=r"press\.v1\.tmd is there already"):
        check_names(OutputFolder(tmp_path), ["press.v1"], ["tmd"])
    assert (tmp_path / "press.v1.tmd").read_bytes() == b"my own"


def marks() -> MarkerField:
    at = np.array([[2, 2], [5, 2]], np.float32)
    return MarkerField(np.arange(2, dtype=np.int32), at, at + 1, np.array([True, False]), 0.1)


def drag() -> DisplacementField:
    return DisplacementField(np.full((*SHAPE, 2), 0.1, np.float32), ONES, 0.1)


@pytest.mark.parametrize(
    "quantities",
    [(marks(),), (drag(),), (marks(), drag()), (height(), marks(), drag())],
)
def test_a_picture_shows_how_the_skin_is_dragged_with_and_without_height(
    tmp_path: Path, quantities: tuple[Quantity, ...]
) -> None:
    (written,) = write_reading(reading(*quantities), tmp_path, ["png"])
    assert written.name == "press.v1.png"
    assert max(read_image(written).shape) >= 640


def test_marks_and_field_are_saved_under_the_names_of_the_contract(tmp_path: Path) -> None:
    (written,) = write_reading(reading(marks(), drag()), tmp_path, ["npz"])
    arrays = read_npz(written)
    assert arrays["displacement_mm"].shape == (*SHAPE, 2)
    np.testing.assert_allclose(arrays["marker_displacement_mm"], 0.1, atol=1e-6)
    assert arrays["marker_seen"].tolist() == [True, False]
