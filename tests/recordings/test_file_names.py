"""The order and the times that the names of image files give."""

from __future__ import annotations

import random

import pytest

from tactile_core.recordings.session_files import sorted_by_name, times_of


@pytest.mark.parametrize(
    "names",
    [
        ["12.04.png", "12.2.png", "13.1.png"],
        ["12,04.png", "12,2.png"],
        ["t0.0.png", "t0.25.png", "t0.5.png"],
        ["f.png", "f (1).png", "f (2).png", "f (10).png"],
        ["f2.png", "f2 (1).png", "f10.png"],
        ["f1.png", "f1 - copy.png", "f2.png"],
        ["1.9.png", "1.10.png", "1.11.png"],  # parts of a number, as of a version or a grid
        ["2.0001.png", "2.0002.png", "2.0010.png"],
        ["Ball-1.jpg", "ball-2.png", "Ball-10.jpg"],
        ["9.png", "10.PNG", "11.png"],
        ["session 1.9", "session 1.10"],
    ],
)
def test_names_are_sorted_by_their_numbers(names: list[str]) -> None:
    mixed = random.Random(0).sample(names, len(names))
    assert sorted_by_name(mixed, str) == names


@pytest.mark.parametrize(
    ("names", "times_s"),
    [
        (["12.04", "12.2", "13"], [12.04, 12.2, 13]),
        (["t=0.00s", "t=0.04s"], [0, 0.04]),
        (["0,5", "0,75"], [0.5, 0.75]),
        (["cam1_1700000000123", "cam1_1700000000163"], [1700000000.123, 1700000000.163]),
        (["1700000000123456", "1700000000163456"], [1700000000.123456, 1700000000.163456]),
        (["1700000000123456789", "1700000000163456789"], [1700000000.123457, 1700000000.163457]),
        (["1700000000.25", "1700000000.5"], [1700000000.25, 1700000000.5]),
    ],
)
def test_names_that_are_times_are_read(names: list[str], times_s: list[float]) -> None:
    assert times_of(names) == pytest.approx(times_s, abs=1e-6)


@pytest.mark.parametrize(
    "names",
    [
        [],
        ["12.04"],
        ["0001", "0002"],
        ["1.9", "1.10"],
        ["12.2", "12.04"],
        ["12.04", "12.04"],
        ["12.04", "12.2", "last"],
        ["depth 0.25", "depth 0.50"],
        ["1700000000123", "cam_1700000000163"],
        ["0000000000123", "0000000000163"],
        ["gelsight_s09_00001281", "gelsight_s09_00001282"],
    ],
)
def test_other_names_are_no_times(names: list[str]) -> None:
    assert times_of(names) is None
