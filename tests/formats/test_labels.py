"""Manually labelled circles, and the messages about invalid lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.calibration.press_search import TARGET
from tactile_core.errors import InputError
from tactile_core.formats.images import write_png
from tactile_core.formats.labels import read_labels
from tactile_core.formats.npz import write_npz
from tactile_core.recordings.recording import open_recording

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


def drawn(folder: Path, place: str, **arrays: object) -> None:
    """Write a circle as gs_sdk's tool does, in the folder of its press."""
    (folder / place).mkdir(parents=True)
    write_npz(folder / place / "label.npz", arrays)  # type: ignore[arg-type]


def catalogue(folder: Path, *places: str) -> None:
    lines = ["experiment_reldir,diameter(mm)", *(f"{place},6.31" for place in places)]
    (folder / "catalog.csv").write_text("\n".join(lines) + "\n")


def test_circles_in_the_folders_of_gs_sdk_are_keyed_as_their_images(tmp_path: Path) -> None:
    catalogue(tmp_path, "6.310mm/0", "6.310mm/1", "6.310mm/10")
    drawn(tmp_path, "6.310mm/0", center=[52.0, 80.5], radius=17)
    drawn(tmp_path, "6.310mm/10", center=np.array([8, 9]), radius=np.int64(3))
    (tmp_path / "6.310mm/1").mkdir()
    for number in (0, 1, 10):
        write_png(tmp_path / f"6.310mm/{number}/gelsight.png", np.zeros((2, 2), np.uint8))
    circles = read_labels(tmp_path, size_px=(160, 120), largest_radius_px=20.0)
    assert list(circles) == ["6.310mm_0", "6.310mm_10"]
    assert set(circles) < {files.name for files in open_recording(tmp_path).files}
    assert tuple(circles["6.310mm_0"].centre_px) == (52.0, 80.5)
    assert circles["6.310mm_10"].contact_radius_px == 3.0


@pytest.mark.parametrize(
    ("arrays", "says"),
    [
        ({"center": [52.0, 80.0]}, "has no circle: it should hold 'center'"),
        ({"line_center": [5, 8], "radius": 3}, "has no circle"),
        ({"center": [52.0, 80.0, 1.0], "radius": 17}, "has no circle"),
        ({"center": [np.nan, 80.0], "radius": 17}, "has no circle"),
        ({"center": [52.0, 80.0], "radius": 0}, "has no circle"),
        ({"center": ["a", "b"], "radius": 17}, "has no circle"),
        ({"center": [160.0, 80.0], "radius": 17}, r"centre \(160, 80\) is outside the image"),
        ({"center": [52.0, 80.0], "radius": 21}, "contact_radius_px 21 is more than the 20 px"),
    ],
)
def test_an_impossible_circle_in_a_folder_names_its_file(
    tmp_path: Path, arrays: dict[str, object], says: str
) -> None:
    catalogue(tmp_path, "6.310mm/0")
    drawn(tmp_path, "6.310mm/0", **arrays)
    with pytest.raises(InputError, match=says) as refused:
        read_labels(tmp_path, size_px=(160, 120), largest_radius_px=20.0)
    assert str(refused.value).startswith(str(tmp_path / "6.310mm/0/label.npz"))
    assert "\n" not in str(refused.value)


def test_a_folder_without_circles_is_refused(tmp_path: Path) -> None:
    for lists in (False, True):
        if lists:
            catalogue(tmp_path, "6.310mm/0")
        with pytest.raises(InputError, match=r"has no circles: .*; give such a folder, or a CSV"):
            read_labels(tmp_path)


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
