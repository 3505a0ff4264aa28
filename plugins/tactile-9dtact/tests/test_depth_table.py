"""A folder of 9DTact measures the heights that its own program computes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tactile_9dtact.depth_table import DepthTable, DepthTableImporter
from tactile_core import Frame, InputError, Reference, load_profile
from tactile_core.profiles.model import Profile

Array = np.ndarray[Any, Any]

HEIGHT, WIDTH, MM_PER_PX = 48, 64, 0.05
CHANNELS = ("red", "green", "blue")


def profile_at(
    folder: Path, width: int = WIDTH, height: int = HEIGHT, mm_per_px: float = MM_PER_PX
) -> Profile:
    path = folder / "nine.yaml"
    path.write_text(
        f"schema: 1\nname: nine\nimage: {{width_px: {width}, height_px: {height}, "
        f"mm_per_px: {mm_per_px}}}\nillumination: {{use: core.constant}}\n"
        "calibration: {use: core.automatic}\nestimators: {height: {use: core.poisson}}\n"
    )
    return load_profile(path)


@pytest.fixture
def sensor(tmp_path: Path) -> Path:
    """Return a folder in the layout of 9DTact, with a camera whose image is mirrored."""
    folder = tmp_path / "sensor_1"
    rows, columns = np.indices((HEIGHT, WIDTH), np.int32)
    table = np.concatenate([[-0.9], np.linspace(0.02, 1.9, 60)])
    for name, array in {
        "depth_calibration/Pixel_to_Depth": table,
        "camera_calibration/row_index": rows,
        "camera_calibration/col_index": columns[:, ::-1].copy(),
        "camera_calibration/position_scale": np.array([24.0, 32.0, MM_PER_PX]),
    }.items():
        path = folder / f"{name}.npy"
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, array)
    return folder


def published(table: Array, grey: Array, reference_grey: Array) -> Array:
    """Return the height map in mm; differences of bytes wrap around, as in the program."""
    raw = reference_grey - grey - np.uint8(2)
    level = raw * (raw < 100).astype(np.uint8) + np.uint8(2)
    level[level > len(table) - 1] = len(table) - 1
    blurred = cv2.GaussianBlur(level.astype(np.float32), (7, 7), 0).astype(int)
    height = (table[blurred] - table[2]).astype(np.float32)
    for _ in range(2):
        height = np.asarray(cv2.GaussianBlur(height, (7, 7), 0), np.float32)
    return height


def images(height: int = HEIGHT, width: int = WIDTH) -> tuple[Array, Array]:
    """Return an image that is dark in a disc and brighter elsewhere, and its reference, in RGB."""
    rng = np.random.default_rng(0)
    y, x = np.indices((height, width))
    reference = rng.integers(120, 130, (height, width, 3), np.uint8)
    darkening = np.maximum(0, 80 - 0.4 * ((y - 20) ** 2 + (x - 25) ** 2)).astype(int)
    noise = rng.integers(-3, 9, (height, width, 3))
    return (reference - darkening[..., None] + noise).astype(np.uint8), reference


def measured(model: DepthTable, image: Array, reference: Array) -> Array:
    frame = Frame(image, CHANNELS, MM_PER_PX)
    return model.measure(frame, Reference(reference.astype(np.float32), CHANNELS)).mm


def grey(image: Array) -> Array:
    return np.asarray(cv2.cvtColor(image[..., ::-1].copy(), cv2.COLOR_BGR2GRAY))


def test_heights_are_those_of_the_program(sensor: Path, tmp_path: Path) -> None:
    image, reference = images()
    table = np.load(sensor / "depth_calibration" / "Pixel_to_Depth.npy")
    model = DepthTableImporter().read(sensor, profile_at(tmp_path))
    expected = published(table, grey(image)[:, ::-1], grey(reference)[:, ::-1])
    assert expected.max() > 1
    np.testing.assert_allclose(measured(model, image, reference), expected, atol=1e-4)


def test_pixels_that_the_camera_does_not_see_are_level_and_not_valid(
    sensor: Path, tmp_path: Path
) -> None:
    for name in ("row", "col"):
        path = sensor / "camera_calibration" / f"{name}_index.npy"
        index = np.load(path)
        index[:, 50:] = 0  # as 9DTact fills them
        np.save(path, index)
    image, reference = images()
    image[0, 0] = 60
    model = DepthTableImporter().read(sensor, profile_at(tmp_path))
    frame = Frame(image, CHANNELS, MM_PER_PX)
    height = model.measure(frame, Reference(reference.astype(np.float32), CHANNELS))
    assert not height.valid[:, 50:].any()
    assert height.valid[:, :50].all()
    np.testing.assert_array_equal(height.mm[:, 60:], 0)


def test_an_image_smaller_than_the_camera_s_is_rectified_already(
    sensor: Path, tmp_path: Path
) -> None:
    image, reference = images(40, 50)
    table = np.load(sensor / "depth_calibration" / "Pixel_to_Depth.npy")
    model = DepthTableImporter().read(sensor, profile_at(tmp_path, 50, 40))
    assert model.rectification is None
    expected = published(table, grey(image), grey(reference))
    np.testing.assert_allclose(measured(model, image, reference), expected, atol=1e-4)


@pytest.mark.parametrize("size", [(WIDTH, HEIGHT), (50, 40)])
def test_a_bundle_measures_as_the_table_that_it_was_made_of(
    sensor: Path, tmp_path: Path, size: tuple[int, int]
) -> None:
    model = DepthTableImporter().read(sensor, profile_at(tmp_path, *size))
    model.save(tmp_path)
    again = DepthTable.load(tmp_path)
    both = images(size[1], size[0])
    np.testing.assert_array_equal(measured(again, *both), measured(model, *both))


def without_scale(folder: Path) -> None:
    (folder / "camera_calibration" / "position_scale.npy").unlink()


def overwrite(name: str, array: Array) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        (path,) = folder.glob(f"*/{name}.npy")
        np.save(path, array, allow_pickle=True)

    return write


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (without_scale, "has 0 files position_scale.npy; give the folder of one sensor of 9DTact"),
        (overwrite("Pixel_to_Depth", np.zeros((3, 3))), r"is \(3, 3\), not one depth for each"),
        (overwrite("Pixel_to_Depth", np.zeros(2)), r"is \(2,\), not one depth for each"),
        (overwrite("Pixel_to_Depth", np.array([{}])), "is no .npy file of an array"),
        (overwrite("Pixel_to_Depth", np.full(9, np.nan)), "holds other values than finite numbers"),
        (overwrite("row_index", np.zeros((4, 4))), "holds other values than whole numbers"),
        (overwrite("row_index", np.full((HEIGHT, WIDTH), 48)), "a position is outside the image"),
        (overwrite("row_index", np.zeros((4, 4), int)), "no images of whole numbers of one size"),
        (overwrite("position_scale", np.ones(2)), "not row, column and scale"),
    ],
)
def test_a_folder_that_is_not_9dtact_s_is_one_sentence(
    sensor: Path, tmp_path: Path, spoil: Callable[[Path], None], said: str
) -> None:
    spoil(sensor)
    with pytest.raises(InputError, match=said) as refusal:
        DepthTableImporter().read(sensor, profile_at(tmp_path))
    assert "\n" not in str(refusal.value)


def test_another_scale_or_a_larger_image_is_one_sentence(sensor: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"0\.05 mm per px .* says 0\.06; correct 'image"):
        DepthTableImporter().read(sensor, profile_at(tmp_path, mm_per_px=0.06))
    with pytest.raises(InputError, match=r"a camera of 64 × 48 .* larger images, 80 × 48"):
        DepthTableImporter().read(sensor, profile_at(tmp_path, width=80))


@pytest.mark.recordings
def test_the_folder_of_a_real_sensor_measures_the_ball_that_pressed_it(
    recordings: Path, tmp_path: Path
) -> None:
    folder = recordings / "ninedtact" / "sensor_1"
    if not folder.exists():
        pytest.skip(f"{folder} is missing; it is a sensor's folder of 9DTact")
    table = np.load(folder / "depth_calibration" / "Pixel_to_Depth.npy")
    rows, columns = (
        np.load(folder / "camera_calibration" / f"{name}_index.npy") for name in ("row", "col")
    )
    pictures = [
        cv2.imread(str(folder / "depth_calibration" / name)) for name in ("sample.png", "ref.png")
    ]
    image, reference = (np.asarray(picture)[..., ::-1].copy() for picture in pictures)
    model = DepthTableImporter().read(folder, profile_at(tmp_path, 640, 480, 0.05102))
    height = measured(model, image, reference)
    expected = published(table, grey(image[rows, columns]), grey(reference[rows, columns]))
    np.testing.assert_allclose(height, expected, atol=1e-4)
    # a sphere through the points of the contact: x² + y² + z² is linear in x, y and z
    y, x = np.nonzero(height > 0.3 * height.max())
    points = np.column_stack([x * 0.05102, y * 0.05102, height[y, x]])
    terms = np.column_stack([points, np.ones(len(points))])
    solved = np.linalg.lstsq(terms, (points**2).sum(axis=1), rcond=None)[0]
    middle = solved[:3] / 2
    assert np.sqrt(solved[3] + (middle**2).sum()) == pytest.approx(4.0, abs=0.2)
    assert middle[2] < 0, "the ball presses, and its top is the highest point"
