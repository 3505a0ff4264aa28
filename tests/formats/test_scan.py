"""Reading of ``scan.yaml``, including files of the manufacturer's software."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from tactile_core.errors import InputError
from tactile_core.formats.scan import Scan, read_scan

WORDS = st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), min_size=1, max_size=12)
NAMES = WORDS.filter(lambda w: not set(w) & set("/\\:") and w != "..")


def scan_of(tmp_path: Path, text: str) -> Scan:
    path = tmp_path / "scan.yaml"
    path.write_text(text)
    return read_scan(path)


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(InputError) as caught:
        scan_of(tmp_path, text)
    assert "scan.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    images=st.lists(NAMES, min_size=1, max_size=6),
    scale=st.none() | st.floats(1e-4, 10),
    crop=st.none() | st.tuples(*[st.integers(1, 5000)] * 4),
    other=WORDS,
)
def test_what_is_used_is_read_exactly(
    tmp_path: Path,
    images: list[str],
    scale: float | None,
    crop: tuple[int, int, int, int] | None,
    other: str,
) -> None:
    content = {
        "images": images,
        "guid": other,
        "mmperpixel": scale or 0,
        "crop": list(crop or (0, 0, 0, 0)),
        "annotations": [{"type": "GridCircle", "x": 3, "y": 4.5, "r": 2}],
        "device": {"version": 2, "lights": [True, False]},
    }
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.dump(content, tmp_path / "scan.yaml")
    assert read_scan(tmp_path / "scan.yaml") == Scan(tuple(images), scale, crop)


def test_zero_scale_and_crop_mean_unknown(tmp_path: Path) -> None:
    scan = scan_of(tmp_path, "images: [a.png]\nmmperpixel: 0\ncrop: [0, 0, 0, 0]\n")
    assert (scan.mm_per_px, scan.crop) == (None, None)
    assert scan_of(tmp_path, "images: [a.png]\n") == Scan(("a.png",))


def test_backslashes_and_windows_line_endings_are_accepted(tmp_path: Path) -> None:
    text = "\ufeffimages:\r\n  - sub\\a.png\r\ncalib: ..\\model.yaml\r\ncrop: [1, 2, 3, 4]\r\n"
    path = tmp_path / "scan.yaml"
    path.write_bytes(text.encode())
    scan = read_scan(path)
    assert scan.images == ("sub/a.png",)
    assert scan.crop == (1, 2, 3, 4)


def test_files_that_are_not_scans_are_rejected(tmp_path: Path) -> None:
    assert "'images'" in refusal(tmp_path, "guid: x\n")
    assert "'images'" in refusal(tmp_path, "images: []\n")
    assert "mapping" in refusal(tmp_path, "- a\n- b\n")
    assert ":2:" in refusal(tmp_path, "images: [a.png]\ncrop: [1, 2\nx: }\n")
    assert "mmperpixel" in refusal(tmp_path, "images: [a.png]\nmmperpixel: fine\n")
    assert "positive" in refusal(tmp_path, "images: [a.png]\nmmperpixel: -1\n")
    assert "number" in refusal(tmp_path, "images: [a.png]\nmmperpixel: .nan\n")
    assert "crop" in refusal(tmp_path, "images: [a.png]\ncrop: [1, 2, 3]\n")
    assert "empty" in refusal(tmp_path, "images: [a.png]\ncrop: [1, 2, 0, 4]\n")
    assert "YAML" in refusal(tmp_path, "images: [*undefined]\n")
    assert "YAML" in refusal(tmp_path, "[" * 1200)
    assert "repeated key" in refusal(tmp_path, "images: [a.png]\nimages: [b.png]\n")
    assert "tags" in refusal(tmp_path, "images: !x [a.png]\n")
    with pytest.raises(InputError, match="no such file"):
        read_scan(tmp_path / "absent.yaml")


def test_a_binary_file_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "scan.yaml"
    path.write_bytes(bytes(range(128, 256)))
    with pytest.raises(InputError, match="UTF-8"):
        read_scan(path)


BOMB = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
BOMB += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 30)]


@pytest.mark.parametrize(
    "last",
    ["images: [a.png]", "images: *a29", "images: [a.png]\ncrop: *a29", "guid: *a29"],
)
def test_an_alias_bomb_is_rejected_before_expansion(tmp_path: Path, last: str) -> None:
    assert "aliases" in refusal(tmp_path, "\n".join([*BOMB, last]))


def test_a_list_that_contains_itself_is_rejected(tmp_path: Path) -> None:
    assert "aliases" in refusal(tmp_path, "images: [a.png]\ncrop: &a [1, 2, 3, *a]\n")


def test_a_bomb_of_merge_keys_is_rejected_before_expansion(tmp_path: Path) -> None:
    lines = ["a0: &a0 {x: 1, y: 2}"]
    lines += [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}" for i in range(1, 9)]
    assert "aliases" in refusal(tmp_path, "\n".join(["images: [a.png]", *lines]))


@pytest.mark.parametrize(
    "image", ["../../x.png", "sub/../../x.png", "/etc/x.png", "..\\x.png", "C:\\x.png", "//h/x.png"]
)
def test_an_image_outside_the_scan_folder_is_rejected(tmp_path: Path, image: str) -> None:
    assert "is outside it" in refusal(tmp_path, f"images: [a.png, '{image}']\n")


@pytest.mark.parametrize("scale", [".inf", "1e-300", "1e300", f"{10**400}", "-0.1"])
def test_an_impossible_scale_is_rejected(tmp_path: Path, scale: str) -> None:
    assert "mmperpixel" in refusal(tmp_path, f"images: [a.png]\nmmperpixel: {scale}\n")


def test_a_long_value_is_shortened_and_escaped(tmp_path: Path) -> None:
    message = refusal(tmp_path, f'images: [a.png]\ncrop: "\\e[31m{"x" * 9000}"\n')
    assert "\x1b" not in message
    assert len(message) < 300 + len(str(tmp_path))


def test_an_oversized_scan_is_rejected_before_parsing(tmp_path: Path) -> None:
    assert "too large" in refusal(tmp_path, "images: [a.png]\n" + "#" * 1_000_001)


def test_recorded_scans_are_read(recordings: Path) -> None:
    groove = read_scan(recordings / "six_led/groove/scan.yaml")
    assert groove.images == tuple(f"image0{i}.png" for i in range(1, 7))
    assert groove.mm_per_px == pytest.approx(0.0274581, abs=1e-7)
    penny = read_scan(recordings / "three_colour/penny/penny-001/scan.yaml")
    assert penny.crop == (567, 229, 902, 828)
    flat = read_scan(recordings / "six_led/ball_grid/Flat-001/scan.yaml")
    assert (flat.mm_per_px, flat.crop) == (None, None)
