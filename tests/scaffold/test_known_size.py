"""Parsing of a length or a rectangle of known size."""

from __future__ import annotations

import pytest

from tactile_core.errors import InputError
from tactile_core.scaffold import KnownSize


def test_a_length_has_two_ends() -> None:
    known = KnownSize.parse("10", "20,60, 100.5,60")
    assert known == KnownSize((10.0,), ((20.0, 60.0), (100.5, 60.0)))


def test_a_rectangle_has_four_corners() -> None:
    known = KnownSize.parse("24x32", "33,58,208,61,185,244,56,250")
    assert known is not None
    assert known.is_rectangle
    assert known.size_mm == (24.0, 32.0)


def test_without_options_there_is_none() -> None:
    assert KnownSize.parse(None, None) is None


@pytest.mark.parametrize(
    ("size", "points"),
    [
        ("10", None),
        (None, "1,2,3,4"),
        ("ten", "1,2,3,4"),
        ("10", "1,2,3"),
        ("10", "1,2,3,4,5,6,7,8"),
        ("0", "1,2,3,4"),
        ("-10", "1,2,3,4"),
        ("nan", "1,2,3,4"),
        ("10", "5,5,5,5"),
        ("10x20", "1,2,3,4"),
        ("1x2x3", "1,2,3,4,5,6,7,8,9,10,11,12"),
        ("10x20", "0,0,0,50,50,50,50,0"),
        ("10x20", "0,0,50,0,0,50,50,50"),
    ],
    ids=str,
)
def test_other_forms_are_refused(size: str | None, points: str | None) -> None:
    with pytest.raises(InputError, match="--known-"):
        KnownSize.parse(size, points)


def test_points_outside_the_image_are_refused() -> None:
    known = KnownSize.parse("10", "20,60,100,60")
    assert known is not None
    known.check_within((101, 61))
    with pytest.raises(InputError, match="outside"):
        known.check_within((100, 61))
