import json
from pathlib import Path

import numpy as np
import pytest
from support.command_line import tactile

from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import load_profile

MINI = load_profile("gelsight_mini")


def test_a_mini_is_found_by_its_name_among_boards_with_its_usb_id() -> None:
    mini = ConnectedDevice("/dev/video0", "GelSight Mini R0B 2BNN-4ZE7", "0c45:636d", "2BNN4ZE7")
    board = ConnectedDevice("/dev/video2", "USB Camera", "0c45:636d")
    selectors = resolve("camera", MINI.camera.use).selectors
    assert mini.fits(MINI.camera.options, selectors)
    assert not board.fits(MINI.camera.options, selectors)


def test_the_camera_image_becomes_320_by_240_without_stretching() -> None:
    geometry = ImageGeometry(MINI.image)
    size = MINI.camera.options["width_px"], MINI.camera.options["height_px"]
    assert geometry.apply(np.zeros((*size[::-1], 3), np.uint8)).shape == (240, 320, 3)
    assert geometry.stretch(size) == pytest.approx(1, abs=0.005)


def test_the_view_is_centred_in_the_camera_image() -> None:
    assert MINI.image.crop is not None
    x, y, width, height = MINI.image.crop
    assert (2 * x + width, 2 * y + height) == (3280, 2464)


def test_the_marked_gel_differs_in_its_markers_only() -> None:
    marked = load_profile("gelsight_mini_marked")
    assert marked.gel == MINI.gel.model_copy(update={"markers": "auto"})
    assert (marked.image, marked.camera, marked.illumination) == (
        MINI.image,
        MINI.camera,
        MINI.illumination,
    )


@pytest.mark.parametrize("name", ["gelsight_mini", "gelsight_mini_marked"])
def test_the_virtual_mini_needs_no_device(name: str) -> None:
    done = tactile("run", name, "--sim", "--reference", "first", "--frames", 3, "--json")
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["sequence"] for line in lines] == [0, 1, 2]
    if name == "gelsight_mini_marked":
        assert {line["markers"]["expected"] for line in lines} == {70}


@pytest.mark.recordings
def test_every_dot_of_a_recorded_gel_is_followed(recordings: Path, tmp_path: Path) -> None:
    cropped = tmp_path / "cropped.yaml"
    cropped.write_text("extends: gelsight_mini_marked\nname: cropped\nimage: {crop: null}\n")
    frames = recordings / "markers" / "mini" / "frames"
    done = tactile("run", cropped, "--input", frames, "--reference", "first", "--json")
    assert done.returncode == 0, done.stderr
    markers = [json.loads(line)["markers"] for line in done.stdout.splitlines()]
    assert {one["expected"] for one in markers} == {70}
    assert min(one["seen"] for one in markers) >= 65
