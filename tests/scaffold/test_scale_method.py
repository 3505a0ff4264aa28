"""What ``--scale`` takes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.errors import InputError
from tactile_core.scaffold.scale import ScaleMethod


def test_a_number_is_the_scale_itself() -> None:
    assert ScaleMethod.parse("0.065") == ScaleMethod("given", (0.065,))


def test_a_length_has_two_ends() -> None:
    method = ScaleMethod.parse("calliper:10@20,60, 100.5,60")
    assert method == ScaleMethod("calliper", (10.0,), ((20.0, 60.0), (100.5, 60.0)))
    assert not method.needs_image


def test_a_rectangle_has_four_corners() -> None:
    method = ScaleMethod.parse("rectangle:24x32@33,58,208,61,185,244,56,250")
    assert (method.kind, method.size_mm) == ("rectangle", (24.0, 32.0))


@pytest.mark.parametrize("text", ["grid:2", "balls:6", "calliper:10"])
def test_what_is_found_needs_an_image(text: str) -> None:
    assert ScaleMethod.parse(text).needs_image


def test_a_file_is_a_grid_of_balls() -> None:
    assert ScaleMethod.parse("balls/target.yaml").target == Path("balls/target.yaml")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "ten",
        "0",
        "-1",
        "nan",
        "9" * 400,
        "grid",
        "grid:",
        "grid:two",
        "grid:2x2",
        "grid:2@1,2,3,4",
        "markers:0",
        "ruler:10",
        "calliper:10@1,2,3",
        "calliper:10@1,2,3,4,5,6,7,8",
        "calliper:-10@1,2,3,4",
        "calliper:10@5,5,5,5",
        "calliper:10@",
        "rectangle:10x20",
        "rectangle:10@0,0,50,0,50,50,0,50",
        "rectangle:10x20@1,2,3,4",
        "rectangle:1x2x3@0,0,50,0,50,50,0,50",
        "rectangle:10x20@0,0,0,50,50,50,50,0",
        "rectangle:10x20@0,0,50,0,0,50,50,50",
    ],
    ids=str,
)
def test_other_forms_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="--scale"):
        ScaleMethod.parse(text)


def test_points_outside_the_image_are_refused() -> None:
    method = ScaleMethod.parse("calliper:10@20,60,100,60")
    method.check_within((101, 61))
    with pytest.raises(InputError, match="outside"):
        method.check_within((100, 61))
