"""CSV files of measured forces and of known weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.labels import read_forces, read_weights


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "forces.csv"
    path.write_text(text)
    return path


def test_frames_with_some_components(tmp_path: Path) -> None:
    table = read_forces(written(tmp_path, "frame, fz_n, tz_nmm\n0, 1.5, 2\n7, ,3\n"))
    assert (table.key, table.rows) == ("frame", ("0", "7"))
    expected = [[np.nan, np.nan, 1.5, 2], [np.nan, np.nan, np.nan, 3]]
    np.testing.assert_array_equal(table.forces, expected)


def test_rows_may_name_their_sequence(tmp_path: Path) -> None:
    table = read_forces(written(tmp_path, "frame,fz_n,sequence\n0,1,press a\n1,2,press b\n"))
    assert table.sequences == ("press a", "press b")
    assert read_forces(written(tmp_path, "frame,fz_n\n0,1\n")).sequences == ("",)


def test_files_lose_their_ending_and_folder(tmp_path: Path) -> None:
    table = read_forces(written(tmp_path, "file,fx_n\nframes/a.png,1\nb.c,2\n"))
    assert table.rows == ("a", "b.c")


def test_times(tmp_path: Path) -> None:
    table = read_forces(written(tmp_path, "time_s,fy_n\n0.5,1\n0.7,2\n"))
    assert table.times_s.tolist() == [0.5, 0.7]
    assert table.rows == ()


def test_weights_become_normal_forces(tmp_path: Path) -> None:
    table = read_weights(written(tmp_path, "file,mass_g\na.png,100\n"))
    assert table.forces[0, 2] == pytest.approx(0.980665)
    assert np.isnan(table.forces[0, [0, 1, 3]]).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no line"),
        ("fz_n\n1\n", "no column frame, file or time_s"),
        ("frame,force_N\n0,1\n", "no column fx_n"),
        ("frame,fz_n\n", "no line"),
        ("frame,fz_n\n0,\n", "no line"),
        ("frame,fz_n\n0,abc\n", ":2: fz_n must be a number, not 'abc'"),
        ("frame,fz_n\n0.5,1\n", "frame must be a number from 0 on"),
        ("frame,fz_n\n0,1\n0,2\n", "'0' has several lines"),
        ("file,fz_n\n,1\n", "'file' is empty"),
        ("time_s,fz_n\n1,1\n0,2\n", "time_s must increase"),
        ("time_s,fz_n\n0,1\n1,1\n1,2\n", "time_s must increase"),
        ('frame,fz_n\n0,"1\n', "not CSV"),
    ],
)
def test_a_broken_file_is_refused_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        read_forces(written(tmp_path, text))


def test_broken_weights_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="file,mass_g"):
        read_weights(written(tmp_path, "file,kg\na,1\n"))
    with pytest.raises(InputError, match="negative"):
        read_weights(written(tmp_path, "file,mass_g\na,-1\n"))
