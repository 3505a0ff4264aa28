"""A catalogue gives the diameter of each ball."""

from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.formats.catalog import Catalog, find_catalog


def catalog(folder: Path, *lines: str) -> Catalog:
    (folder / "catalog.csv").write_text("\n".join(lines) + "\n")
    found = find_catalog(folder)
    assert found is not None
    return found


def test_folders_as_gs_sdk_lists_them(tmp_path: Path) -> None:
    found = catalog(tmp_path, "experiment_reldir,diameter(mm)", "ball_4/0,4.0", "ball_6/0,6.31")
    assert found.of_folders
    assert found.diameter_mm(tmp_path / "ball_4/0/gelsight.png") == 4.0
    assert found.diameter_mm(tmp_path / "ball_6/0/gelsight.png") == 6.31
    assert found.diameter_mm(tmp_path / "ball_8/0/gelsight.png") is None


@pytest.mark.parametrize("name", ["press_1.png", "press_1"])
def test_files_with_or_without_their_suffix(tmp_path: Path, name: str) -> None:
    found = catalog(tmp_path, "file, diameter_mm", f"{name}, 4")
    assert not found.of_folders
    assert found.diameter_mm(tmp_path / "press_1.png") == 4.0
    assert found.diameter_mm(tmp_path / "press_10.png") is None


def test_a_file_of_another_kind_is_no_catalogue(tmp_path: Path) -> None:
    assert find_catalog(tmp_path) is None
    (tmp_path / "catalog.csv").write_text("title,author\na,b\n")
    assert find_catalog(tmp_path) is None


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("a.png,four", "a positive number"),
        ("a.png,-1", "a positive number"),
        ("a.png,nan", "a positive number"),
        ("../a.png,4", "inside the folder"),
        ("/a.png,4", "inside the folder"),
        (",4", "inside the folder"),
        ("b.png,4\nb.png,5", "already has a diameter"),
    ],
)
def test_an_invalid_line_is_named(tmp_path: Path, line: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as refused:
        catalog(tmp_path, "file,diameter_mm", line)
    assert "catalog.csv:" in str(refused.value)


def test_a_path_that_is_not_there_is_named(tmp_path: Path) -> None:
    found = catalog(tmp_path, "file,diameter_mm", "a.png,4")
    with pytest.raises(InputError, match=r"a\.png, which is not in that folder"):
        found.check_listed()
    (tmp_path / "a.png").touch()
    found.check_listed()


def test_semicolons_and_decimal_commas_of_a_spreadsheet_are_read(tmp_path: Path) -> None:
    found = catalog(tmp_path, "file;diameter_mm", "press 1,5 N.png;6,31", "b.png;4")
    assert found.diameters_mm == {"press 1,5 N.png": 6.31, "b.png": 4.0}
