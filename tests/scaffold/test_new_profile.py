"""A profile from an image: it holds the differences from its parent, measured if possible."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scaffold.pictures import photograph, sensor

from experiments.measured_scale import grid
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.errors import InputError, ProfileError
from tactile_core.interfaces.gel import Markers
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.scaffold import NewProfile, new_profile
from tactile_core.scaffold.markers import FoundMarkers, find_markers, markers_finding
from tactile_sim.optics.rig import render

UNMARKED = "hex_fingertip_unmarked"


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """The undeformed gel of a small sensor without markers."""
    return photograph(sensor(), tmp_path / "reference.png")


def saved(made: NewProfile, folder: Path) -> Profile:
    """Write it and load it as a user would."""
    made.write(folder / f"{made.name}.yaml")
    return load_profile(folder / f"{made.name}.yaml")


def test_the_profile_holds_only_differences(picture: Path, tmp_path: Path) -> None:
    made = new_profile("mine", UNMARKED, picture, scale="0.125")
    keys = [line.split(":")[0].strip() for line in made.text.splitlines() if _has_key(line)]
    assert keys == [
        "extends",
        "name",
        "revision",
        "description",
        "image",
        "width_px",
        "height_px",
        "mm_per_px",
        "camera",
        "usb_id",
    ]
    profile = saved(made, tmp_path)
    parent = load_profile(UNMARKED)
    assert (profile.image.width_px, profile.image.height_px) == (160, 120)
    assert profile.image.mm_per_px == 0.125
    assert profile.gel == parent.gel
    assert profile.estimators == parent.estimators


def test_for_an_image_of_the_parents_size_the_size_is_inherited(tmp_path: Path) -> None:
    parent = load_profile(UNMARKED)
    made = new_profile("mine", UNMARKED, photograph(parent, tmp_path / "a.png"))
    assert "width_px" not in made.text
    assert saved(made, tmp_path).image == parent.image


def test_inherited_values_are_reported(picture: Path, tmp_path: Path) -> None:
    made = new_profile("mine", UNMARKED, picture)
    parent = load_profile(UNMARKED).image
    view_mm = parent.width_px * parent.mm_per_px
    assert saved(made, tmp_path).image.mm_per_px == pytest.approx(view_mm / 160, rel=1e-4)
    assert any("NOT MEASURED" in note for note in made.notes)
    assert "# NOT MEASURED" in made.text
    assert any("gel.thickness_mm 2" in note for note in made.notes)
    assert "thickness_mm: 2" in made.text


def test_a_known_length_gives_the_scale(picture: Path, tmp_path: Path) -> None:
    made = new_profile("mine", UNMARKED, picture, scale="calliper:5@20,30,52,54")
    assert saved(made, tmp_path).image.mm_per_px == pytest.approx(5 / 40)
    assert not any("MEASURED" in note for note in made.notes)


def test_the_scale_accounts_for_downscaling(tmp_path: Path) -> None:
    large = sensor(image={"width_px": 1280, "height_px": 960, "mm_per_px": 0.0138})
    picture = photograph(large, tmp_path / "large.png")
    made = new_profile("mine", UNMARKED, picture, scale="calliper:10@100,100,824.6,100")
    image = saved(made, tmp_path).image
    assert (image.width_px, image.height_px) == (640, 480)
    assert image.mm_per_px == pytest.approx(2 * 0.0138, rel=1e-3)


def test_a_rectangle_rectifies_the_view_and_gives_the_scale(tmp_path: Path) -> None:
    straight = photograph(sensor("hex_fingertip"), tmp_path / "straight.png")
    corners = np.array([[30, 20], [140, 32], [126, 110], [24, 100]], np.float32)
    full = np.array([[0, 0], [160, 0], [160, 120], [0, 120]], np.float32)
    view = cv2.getPerspectiveTransform(full, corners)
    tilted = cv2.warpPerspective(cv2.imread(str(straight)), view, (170, 130))
    cv2.imwrite(str(tmp_path / "tilted.png"), tilted)
    points = ",".join(f"{v:g}" for v in corners.ravel())
    made = new_profile("mine", UNMARKED, tmp_path / "tilted.png", scale=f"rectangle:20x15@{points}")
    image = saved(made, tmp_path).image
    assert image.width_px * image.mm_per_px == pytest.approx(20, rel=0.01)
    assert image.height_px * image.mm_per_px == pytest.approx(15, rel=0.01)
    assert image.warp is not None
    assert np.array_equal(np.array(image.warp.source), corners)


def test_markers_are_found_and_their_pitch_gives_the_scale(tmp_path: Path) -> None:
    small = {"width_px": 320, "height_px": 240, "mm_per_px": 0.06}
    marked = sensor("hex_fingertip", image=small)
    picture = photograph(marked, tmp_path / "marked.png")
    profile = saved(new_profile("mine", UNMARKED, picture, scale="markers:1.1"), tmp_path)
    assert profile.image.mm_per_px == pytest.approx(0.06, rel=0.02)
    assert isinstance(profile.gel.markers, Markers)
    assert profile.gel.markers.pitch_mm == pytest.approx(1.1, rel=0.01)
    assert profile.gel.markers.diameter_mm == pytest.approx(0.4, rel=0.25)


def test_a_gel_without_markers_is_reported_from_a_parent_with_them(
    picture: Path, tmp_path: Path
) -> None:
    made = new_profile("mine", "hex_fingertip", picture, scale="0.125")
    assert saved(made, tmp_path).gel.markers is None
    assert any("no lattice of markers" in note for note in made.notes)


def test_the_parents_camera_is_not_taken_for_this_sensors(picture: Path, tmp_path: Path) -> None:
    assert load_profile("hex_fingertip").camera.options["usb_id"]
    made = new_profile("mine", "hex_fingertip", picture, scale="0.125")
    assert saved(made, tmp_path).camera.options.get("usb_id") is None
    assert "'tactile devices' lists them" in " ".join(made.text.split())


def test_dark_surroundings_are_cropped(tmp_path: Path) -> None:
    lit = cv2.imread(str(photograph(sensor(), tmp_path / "lit.png")))
    framed = cv2.copyMakeBorder(lit, 20, 10, 30, 40, cv2.BORDER_CONSTANT)
    cv2.imwrite(str(tmp_path / "framed.png"), framed)
    made = new_profile("mine", UNMARKED, tmp_path / "framed.png", scale="0.125")
    crop = saved(made, tmp_path).image.crop
    assert crop is not None
    assert np.abs(np.subtract(crop, (30, 20, 160, 120))).max() <= 3


def test_a_scale_that_contradicts_that_of_the_scan_is_refused(picture: Path) -> None:
    scan = picture.with_name("scan.yaml")
    scan.write_text(f"images: [{picture.name}]\nmmperpixel: 0.2\n")
    with pytest.raises(InputError, match="give only the one that is right"):
        new_profile("mine", UNMARKED, scan, scale="calliper:5@20,30,52,54")


def photograph_grid(path: Path, aspect: float = 1.0) -> Path:
    printed = grid("lines", 16.0, 4.0, 0.0, 0, aspect)[60:180, 80:240]
    cv2.imwrite(str(path), cv2.cvtColor(printed, cv2.COLOR_GRAY2BGR))
    return path


def test_a_photograph_of_a_printed_grid_gives_the_scale(picture: Path, tmp_path: Path) -> None:
    printed = photograph_grid(tmp_path / "grid.png")
    made = new_profile("mine", UNMARKED, picture, scale="grid:2", scale_image=printed)
    assert saved(made, tmp_path).image.mm_per_px == pytest.approx(2 / 16, rel=0.01)
    (note,) = (note for note in made.notes if "along x" in note)
    assert "±" in note
    assert "differ" not in note


def test_pixels_that_are_not_square_are_reported(picture: Path, tmp_path: Path) -> None:
    printed = photograph_grid(tmp_path / "grid.png", aspect=1.08)
    made = new_profile("mine", UNMARKED, picture, scale="grid:2", scale_image=printed)
    (note,) = (note for note in made.notes if "along x" in note)
    assert "the pixels are not square" in note
    factor = float(note.split("'height_px' ")[1].split(" times")[0])
    assert factor == pytest.approx(1.08, abs=0.02)


def test_two_balls_at_once_give_the_scale(tmp_path: Path) -> None:
    small = sensor()
    reference = photograph(small, tmp_path / "reference.png")
    shape = small.image.height_px, small.image.width_px
    both = [BallPress(place, 4.0, 0.6).height_mm(shape, 0.125) for place in ((50, 50), (98, 64))]
    pressed = render(small, np.maximum(*both), seed=3)
    cv2.imwrite(str(tmp_path / "balls.png"), pressed[..., ::-1])
    made = new_profile(
        "mine", UNMARKED, reference, scale="balls:6.25", scale_image=tmp_path / "balls.png"
    )
    assert saved(made, tmp_path).image.mm_per_px == pytest.approx(0.125, rel=0.01)
    single = photograph(small, tmp_path / "single.png", BallPress((50, 50), 4.0, 0.6))
    with pytest.raises(InputError, match=r"no two equal imprints.*balls:6@x,y,x,y"):
        new_profile("mine", UNMARKED, reference, scale="balls:6", scale_image=single)


def test_an_image_of_another_size_measures_no_scale(picture: Path, tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "other.png"), np.zeros((60, 80, 3), np.uint8))
    with pytest.raises(InputError, match="80 × 60 px and --image 160 × 120; record both alike"):
        new_profile("a", UNMARKED, picture, scale="grid:2", scale_image=tmp_path / "other.png")


def test_the_scale_is_asked_for_only_if_no_input_gives_it(picture: Path, tmp_path: Path) -> None:
    asked = []

    def answer(question: str) -> str:
        asked.append(question)
        return "0,125"

    profile = saved(new_profile("mine", UNMARKED, picture, ask=answer), tmp_path)
    assert profile.image.mm_per_px == 0.125
    assert len(asked) == 1
    new_profile("other", UNMARKED, picture, scale="0.1", ask=answer)
    assert len(asked) == 1
    unknown = new_profile("third", UNMARKED, picture, ask=lambda question: "")
    assert any("NOT MEASURED" in note for note in unknown.notes)
    with pytest.raises(InputError, match="--scale 'wide'"):
        new_profile("fourth", UNMARKED, picture, ask=lambda question: "wide")


def test_a_parent_by_path_is_written_relative_to_the_file(picture: Path, tmp_path: Path) -> None:
    first = new_profile("first", UNMARKED, picture, scale="0.125")
    first.write(tmp_path / "first.yaml")
    place = tmp_path / "deeper" / "second.yaml"
    second = new_profile("second", tmp_path / "first.yaml", picture, out=place, scale="0.124")
    second.write(place)
    assert 'extends: "../first.yaml"' in second.text
    assert load_profile(place).image.mm_per_px == 0.124


def test_the_parents_own_file_is_never_replaced(picture: Path, tmp_path: Path) -> None:
    place = tmp_path / "first.yaml"
    new_profile("first", UNMARKED, picture).write(place)
    with pytest.raises(InputError, match="would replace"):
        new_profile("second", place, picture, out=place)


def test_an_existing_file_is_replaced_only_by_force(picture: Path, tmp_path: Path) -> None:
    made = new_profile("mine", UNMARKED, picture)
    place = tmp_path / "mine.yaml"
    place.write_text("precious")
    with pytest.raises(InputError, match="--force"):
        made.write(place)
    assert place.read_text() == "precious"
    made.write(place, force=True)
    assert place.read_text() == made.text
    with pytest.raises(InputError, match="no file"):
        made.write(tmp_path, force=True)


def test_force_does_not_replace_an_input(picture: Path, tmp_path: Path) -> None:
    first = tmp_path / "first.yaml"
    new_profile("first", UNMARKED, picture).write(first)
    new_profile("second", first, picture, out=tmp_path / "second.yaml").write(
        tmp_path / "second.yaml"
    )
    third = new_profile("third", tmp_path / "second.yaml", picture)
    before = first.read_bytes(), picture.read_bytes()
    for place in (first, picture):
        with pytest.raises(InputError, match="name another --out"):
            third.write(place, force=True)
    assert (first.read_bytes(), picture.read_bytes()) == before


@pytest.mark.parametrize(
    "name", ["", "my-tip", "my tip", "../x", "9lives", "hex_fingertip", "täst", 300 * "a"]
)
def test_a_name_that_cannot_be_used_is_refused(name: str, picture: Path) -> None:
    with pytest.raises(InputError, match=r"name"):
        new_profile(name, UNMARKED, picture)


def test_an_image_of_one_row_shows_no_surface(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "row.png"), np.full((1, 80, 3), 90, np.uint8))
    with pytest.raises(InputError, match="80 × 1 px, which shows no surface"):
        new_profile("mine", UNMARKED, tmp_path / "row.png", scale="0.1")


def test_a_grey_image_needs_a_parent_with_grey_images(tmp_path: Path, picture: Path) -> None:
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((120, 160), 90, np.uint8))
    with pytest.raises(InputError, match="grey"):
        new_profile("mine", UNMARKED, tmp_path / "grey.png")
    for number in range(6):
        (tmp_path / "scan").mkdir(exist_ok=True)
        (tmp_path / "scan" / f"{number}.png").write_bytes(picture.read_bytes())
    with pytest.raises(InputError, match="in colour"):
        new_profile("mine", "desktop_six_led", tmp_path / "scan")


def test_the_bit_depth_is_detected(tmp_path: Path) -> None:
    pixels = np.full((120, 160, 3), 900, np.uint16)
    cv2.imwrite(str(tmp_path / "deep.png"), pixels)
    made = new_profile("mine", UNMARKED, tmp_path / "deep.png", scale="0.125")
    assert saved(made, tmp_path).image.bit_depth == 10


def test_pixels_per_mm_in_place_of_mm_per_pixel_are_refused(picture: Path) -> None:
    with pytest.raises(ProfileError, match="pixels per mm"):
        new_profile("mine", UNMARKED, picture, scale="8.0")


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("parent", "image", "extra", "mm_per_px"),
    [
        (UNMARKED, "three_colour/objectfolder/reference.png", {"scale": "0.1245"}, 0.1245),
        (
            "hex_fingertip",
            "three_colour/wedge/bg-0.jpg",
            {"scale": "rectangle:24x32@33,58,208,61,185,244,56,250"},
            24 / 175,
        ),
        (
            "hex_fingertip",
            "three_colour/hex_fingertip/frame0.jpg",
            {"scale": "markers:1.71"},
            0.03026,
        ),
        ("desktop_six_led", "six_led/ball_grid/BGA-001", {}, 0.0136152),
    ],
)
def test_real_sensors_get_their_scale(
    recordings: Path, tmp_path: Path, parent: str, image: str, extra: Any, mm_per_px: float
) -> None:
    profile = saved(new_profile("mine", parent, recordings / image, **extra), tmp_path)
    assert profile.image.mm_per_px == pytest.approx(mm_per_px, rel=0.025)


@pytest.mark.recordings
def test_pressed_balls_are_not_mistaken_for_markers(recordings: Path, tmp_path: Path) -> None:
    pressed = recordings / "six_led/ball_grid/BGA-002"
    assert saved(new_profile("mine", "desktop_six_led", pressed), tmp_path).gel.markers is None


@pytest.mark.recordings
def test_a_grid_of_balls_gives_the_scale(recordings: Path, tmp_path: Path) -> None:
    grid = recordings / "four_colour" / "ball_grid"
    made = new_profile(
        "mine",
        "baxter_fingertip_flat",
        grid / "Flat-001.png",
        scale=str(grid / "BGA-001_bgatarget.yaml"),
    )
    assert saved(made, tmp_path).image.mm_per_px == pytest.approx(0.0136152, rel=2e-3)


def _has_key(line: str) -> bool:
    return bool(line.strip()) and not line.strip().startswith("#")


@pytest.mark.parametrize("special", ["\u2028", "\u2029", "\x85", "\x1b[31m", "\udcff"])
def test_an_image_with_any_name_gives_a_valid_profile(tmp_path: Path, special: str) -> None:
    picture = photograph(sensor(), tmp_path / "reference.png")
    picture = picture.rename(tmp_path / f"a{special}name: broken.png")
    assert saved(new_profile("mine", UNMARKED, picture, scale="0.125"), tmp_path).name == "mine"


def test_a_marker_count_that_does_not_fit_the_pitch_is_reported() -> None:
    parent = load_profile(UNMARKED)
    found = markers_finding(
        FoundMarkers("dark", 3.4, 14.3, 29, 199, fits=False), parent, 0.14, "image.png"
    )
    assert found is not None
    assert found.noted
    assert "29 are found" in found.comment
    assert "about 199 would fill the image" in found.comment


@pytest.mark.parametrize("width_px", [120, 175, 200])
def test_blurred_markers_of_a_real_wedge_are_found(
    recordings: Path, tmp_path: Path, width_px: int
) -> None:
    picture = cv2.imread(str(recordings / "three_colour" / "wedge" / "bg-0.jpg"))
    scale = width_px / 240
    corners = np.array([[33, 58], [208, 61], [185, 244], [56, 250]], np.float32)
    full = np.array([[0, 0], [240, 0], [240, 320], [0, 320]], np.float32) * scale
    size = width_px, round(320 * scale)
    view = cv2.getPerspectiveTransform(corners, full.astype(np.float32))
    rectified = cv2.warpPerspective(picture, view, size, flags=cv2.INTER_AREA)
    found = find_markers([rectified[..., ::-1]])
    assert found is not None
    assert found.fits
