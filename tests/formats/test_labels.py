"""Manually labelled circles, and the messages about invalid lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.calibration.press_search import TARGET
from tactile_core.errors import InputError
from tactile_core.formats.labels import read_labels

HEADER = "file,centre_x_px,centre_y_px,contact_radius_px\n"


def refusal(tmp_path: Path, text: str) -> str:
    path = tmp_path / "labels.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_labels(path)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(str(path))


def test_circles_are_keyed_by_the_name_of_their_observation(tmp_path: Path) -> None:
    path = tmp_path / "labels.csv"
    rows = "press_00.png,52.0,80.5,17\n\npresses/v1.2.jpg, 1, 2, 3\nscan001,4,5,6\n"
    path.write_text("\ufeff" + HEADER + rows)
    circles = read_labels(path)
    assert list(circles) == ["press_00", "v1.2", "scan001"]
    assert tuple(circles["press_00"].centre_px) == (52.0, 80.5)
    assert circles["press_00"].contact_radius_px == 17.0
    assert circles["press_00"].used


def test_columns_can_have_any_order_and_extra_columns(tmp_path: Path) -> None:
    path = tmp_path / "labels.csv"
    path.write_text("author,contact_radius_px,centre_y_px,centre_x_px,file\nme,3,2,1,a.png\n")
    assert tuple(read_labels(path)["a"].centre_px) == (1.0, 2.0)


def test_an_error_names_its_line(tmp_path: Path) -> None:
    assert refusal(tmp_path, "file,x,y,r\n").startswith(":1: column 'centre_x_px'")
    assert refusal(tmp_path, "").startswith(":1: column")
    good = "a.png,1,2,3\n"
    assert refusal(tmp_path, HEADER + good + "b.png,1,two,3\n").startswith(":3: centre_y_px")
    assert refusal(tmp_path, HEADER + "b.png,1,nan,3\n").startswith(":2: centre_y_px")
    assert refusal(tmp_path, HEADER + "b.png,1,2\n").startswith(":2: contact_radius_px")
    assert "positive" in refusal(tmp_path, HEADER + "b.png,1,2,0\n")
    assert "empty" in refusal(tmp_path, HEADER + ",1,2,3\n")
    assert refusal(tmp_path, HEADER + good + good).startswith(":3: a.png already has a circle")
    assert "CSV" in refusal(tmp_path, HEADER + '"a.png"x,1,2,3\n')


def test_recorded_labels_are_read(recordings: Path) -> None:
    circles = read_labels(recordings / "three_colour/objectfolder/presses.csv")
    assert len(circles) == 20
    widest = max(circle.contact_radius_px for circle in circles.values())
    assert widest < TARGET.widest_label * 2.0 / 0.1245  # they are drawn around a ball of 4 mm
    assert tuple(circles["press_01"].centre_px) == (74.5, 99.0)


def test_a_circle_impossible_for_the_ball_is_rejected_with_its_line(tmp_path: Path) -> None:
    def message_for(line: str) -> str:
        path = tmp_path / "labels.csv"
        path.write_text(f"{HEADER}a.png,159.4,-0.5,20\n{line}\n")
        with pytest.raises(InputError) as caught:
            read_labels(path, size_px=(160, 120), largest_radius_px=20.0)
        return str(caught.value).removeprefix(str(path))

    assert message_for("b.png,80,60,20.1").startswith(":3: contact_radius_px 20.1 is more than")
    for centre in ("160,60", "80,120", "-1,60", "1e300,60"):
        assert message_for(f"b.png,{centre},9").startswith(":3: the circle's centre"), centre


def test_values_in_messages_are_short_and_escaped(tmp_path: Path) -> None:
    message = refusal(tmp_path, f"{HEADER}a.png,\x1b[31m{'x' * 9000},2,3\n")
    assert "\x1b" not in message
    assert len(message) < 300
    line = f"\x1b[31m{'x' * 9000}.png,1,2,3\n"
    assert len(refusal(tmp_path, HEADER + line + line)) < 300


def test_zero_bytes_and_oversized_tables_are_rejected(tmp_path: Path) -> None:
    assert ":2: centre_x_px" in refusal(tmp_path, f"{HEADER}a.png,1\0,2,3\n")
    assert "too large" in refusal(tmp_path, HEADER + "\n" * 10_000_000)
