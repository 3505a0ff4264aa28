"""TMD height maps are read back as written, and invalid ones are rejected."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from tactile_core.errors import InputError
from tactile_core.formats.tmd import read_tmd, write_tmd

HEIGHTS = arrays(
    np.float32,
    array_shapes(min_dims=2, max_dims=2, max_side=12),
    elements=st.floats(width=32, allow_nan=False, allow_infinity=False),
)
WORDS = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=40)
FLOAT32 = st.floats(-1e3, 1e3, width=32)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(HEIGHTS, st.floats(1e-4, 10), WORDS, st.tuples(FLOAT32, FLOAT32))
def test_a_round_trip_is_exact(
    tmp_path: Path,
    height: np.ndarray,
    mm_per_px: float,
    comment: str,
    offset: tuple[float, float],
) -> None:
    path = tmp_path / "a.tmd"
    write_tmd(path, height, mm_per_px, offset_mm=offset, comment=comment)
    back = read_tmd(path)
    assert back.height_mm.dtype == np.float32
    np.testing.assert_array_equal(back.height_mm, height)
    assert back.mm_per_px == pytest.approx(mm_per_px, rel=1e-7)
    assert (back.comment, back.offset_mm) == (comment, offset)


@pytest.fixture
def good(tmp_path: Path) -> bytes:
    write_tmd(tmp_path / "good.tmd", np.ones((3, 4), np.float32), 0.1, comment="words")
    return (tmp_path / "good.tmd").read_bytes()


def refusal(tmp_path: Path, content: bytes) -> str:
    path = tmp_path / "bad.tmd"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_tmd(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    return message


def test_every_truncation_is_rejected(tmp_path: Path, good: bytes) -> None:
    for length in range(len(good)):
        refusal(tmp_path, good[:length])
    assert "4 × 3 heights, but it contains 11" in refusal(tmp_path, good[:-1])


def test_an_oversized_header_is_rejected_without_allocation(tmp_path: Path, good: bytes) -> None:
    at = good.index(b"words\0") + 6
    sizes = struct.pack("<II", 0xFFFFFFFF, 0xFFFFFFFF)
    assert "its header gives" in refusal(tmp_path, good[:at] + sizes + good[at + 8 :])


def test_more_heights_than_in_the_header_are_rejected(tmp_path: Path, good: bytes) -> None:
    assert "4 × 3 heights, but it contains 13" in refusal(tmp_path, good + bytes(4))


def test_an_inconsistent_header_is_rejected(tmp_path: Path, good: bytes) -> None:
    at = good.index(b"words\0") + 6
    empty = good[:at] + struct.pack("<II", 0, 0) + good[at + 8 :]
    assert "corrupt" in refusal(tmp_path, empty)
    lengths = struct.pack("<ff", float("nan"), 1.0)
    assert "corrupt" in refusal(tmp_path, good[: at + 8] + lengths + good[at + 16 :])
    lengths = struct.pack("<ff", 0.4, 0.6)
    assert "non-square" in refusal(tmp_path, good[: at + 8] + lengths + good[at + 16 :])


def test_other_files_are_rejected(tmp_path: Path) -> None:
    assert "not a TMD" in refusal(tmp_path, b"")
    assert "not a TMD" in refusal(tmp_path, b"\x89PNG and so on, long enough for a header at least")
    with pytest.raises(InputError, match="no such file"):
        read_tmd(tmp_path / "absent.tmd")


def test_values_that_the_format_cannot_represent_are_not_written(tmp_path: Path) -> None:
    flat = np.zeros((2, 2), np.float32)
    with pytest.raises(ValueError, match="NUL"):
        write_tmd(tmp_path / "a.tmd", flat, 0.1, comment="a\0b")
    with pytest.raises(ValueError, match="positive"):
        write_tmd(tmp_path / "a.tmd", flat, 0.0)
    with pytest.raises(ValueError, match="shape"):
        write_tmd(tmp_path / "a.tmd", flat[0], 0.1)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("mm_per_px", [1e300, float("inf"), pytest.param(10**400, id="huge")])
def test_a_scale_that_the_format_cannot_represent_is_rejected(
    tmp_path: Path, mm_per_px: float
) -> None:
    with pytest.raises(ValueError, match="mm_per_px"):
        write_tmd(tmp_path / "a.tmd", np.zeros((6, 8), np.float32), mm_per_px)
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_the_manufacturer_is_rewritten_byte_for_byte(
    recordings: Path, tmp_path: Path
) -> None:
    path = recordings / "six_led" / "groove" / "heightmap.tmd"
    tmd = read_tmd(path)
    assert tmd.height_mm.shape == (514, 616)
    assert tmd.mm_per_px == pytest.approx(0.0274581, abs=1e-7)
    write_tmd(tmp_path / "copy.tmd", tmd.height_mm, tmd.mm_per_px, comment=tmd.comment)
    assert (tmp_path / "copy.tmd").read_bytes() == path.read_bytes()
