"""Networks of gs_sdk and gsrobotics measure what their own programs compute, in our axes."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.colour_profile import colour_profile
from support.torch_files import write_torch_file

from tactile_core import Bundle, Frame, Gradients, InputError, Pipeline, Reference, load_profile
from tactile_core.calibration.imported import import_calibration
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.targets import balls
from tactile_core.interfaces.calibration import Silent
from tactile_core.interfaces.importer import Importer
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.model import Profile
from tactile_imports.colour_network import AngleNetworkImporter, NormalNetworkImporter
from tactile_imports.slope_image import STEEPEST
from tactile_imports.torch_file import read_torch_file

Array = np.ndarray[Any, Any]

REPOSITORY = Path(__file__).resolve().parents[3]

HEIGHT, WIDTH = 24, 32
CHANNELS = ("red", "green", "blue")
SDK, ROBOTICS = (5, 32, 32, 32, 2), (5, 64, 64, 64, 2)


def random_network(widths: Sequence[int], scale: float = 1.0) -> dict[str, Array]:
    """Return weights by PyTorch's names; the outputs are a few tenths in size."""
    rng = np.random.default_rng(0)
    state = {}
    for number, (before, after) in enumerate(pairwise(widths), 1):
        gain = scale * np.sqrt(2 / before) if number == 4 else np.sqrt(2 / before)
        state[f"fc{number}.weight"] = rng.normal(0, gain, (after, before)).astype(np.float32)
        state[f"fc{number}.bias"] = rng.normal(0, 0.05, after).astype(np.float32)
    return state


def perceptron(state: Mapping[str, Array], features: Array) -> Array:
    z = features.astype(np.float64)
    for number in range(1, 5):
        z = z @ state[f"fc{number}.weight"].T.astype(float) + state[f"fc{number}.bias"]
        z = np.maximum(z, 0) if number < 4 else z
    return z


def published_by_gs_sdk(state: Mapping[str, Array], bgr: Array, background_bgr: Array) -> Array:
    """Return (H, W, 2) gradients; there, heights decrease where an object presses."""

    def gradients(image: Array) -> Array:
        height, width = image.shape[:2]
        x, y = np.meshgrid(np.arange(width) / width, np.arange(height) / height)
        features = np.dstack([image / 255, x, y])
        return np.tan(perceptron(state, features.reshape(-1, 5)).reshape(height, width, 2))

    return gradients(bgr) - gradients(background_bgr)


def published_by_gsrobotics(state: Mapping[str, Array], bgr: Array) -> Array:
    """Return (H, W, 2) slopes from the components of the normal."""
    height, width = bgr.shape[:2]
    row, column = np.indices((height, width))
    features = np.dstack([bgr / 255, row / height, column / width])
    normal = perceptron(state, features.reshape(-1, 5)).reshape(height, width, 2)
    return -normal / np.sqrt(1 - (normal**2).sum(axis=2, keepdims=True))


@pytest.fixture
def images() -> tuple[Array, Array]:
    """Return a frame and a background in blue, green, red."""
    rng = np.random.default_rng(1)
    frame, background = rng.integers(20, 235, (2, HEIGHT, WIDTH, 3), np.uint8)
    return frame, background


def measured(model: Any, bgr: Array, background_bgr: Array) -> Array:
    frame = Frame(np.ascontiguousarray(bgr[..., ::-1]), CHANNELS, 0.0634)
    pixels = np.ascontiguousarray(background_bgr[..., ::-1], np.float32)
    gradients = model.measure(frame, Reference(pixels, CHANNELS))
    return np.stack([gradients.x, gradients.y], axis=2)


def test_a_network_of_gs_sdk_gives_its_gradients_with_our_sign(
    tmp_path: Path, images: tuple[Array, Array]
) -> None:
    state = random_network(SDK, 1.0)
    file = write_torch_file(tmp_path / "nnmodel.pth", state)
    model = AngleNetworkImporter().read(file, colour_profile(tmp_path, WIDTH, HEIGHT))
    expected = -published_by_gs_sdk(state, *images)
    assert np.abs(expected).max() > 0.4
    np.testing.assert_allclose(measured(model, *images), expected, atol=1e-4)


def test_a_network_of_gsrobotics_gives_its_slopes_less_those_of_the_reference(
    tmp_path: Path, images: tuple[Array, Array]
) -> None:
    state = random_network(ROBOTICS, 0.6)
    file = write_torch_file(tmp_path / "nnmini.pt", {"epoch": 3, "state_dict": state})
    model = NormalNetworkImporter().read(file, colour_profile(tmp_path, WIDTH, HEIGHT))
    frame, background = (published_by_gsrobotics(state, image) for image in images)
    assert np.isfinite(frame).all()
    assert np.abs(frame - background).max() > 0.3
    np.testing.assert_allclose(measured(model, *images), frame - background, atol=1e-4)


@pytest.mark.parametrize(("widths", "scale"), [(SDK, 20.0), (ROBOTICS, 5.0)])
def test_slopes_that_no_gel_has_are_finite_and_not_valid(
    tmp_path: Path, images: tuple[Array, Array], widths: tuple[int, ...], scale: float
) -> None:
    state = random_network(widths, scale)
    importer = AngleNetworkImporter() if widths == SDK else NormalNetworkImporter()
    saved = state if widths == SDK else {"state_dict": state}
    model = importer.read(
        write_torch_file(tmp_path / "a.pt", saved), colour_profile(tmp_path, WIDTH, HEIGHT)
    )
    frame = Frame(np.ascontiguousarray(images[0][..., ::-1]), CHANNELS, 0.0634)
    reference = Reference(images[1][..., ::-1].astype(np.float32), CHANNELS)
    gradients = model.measure(frame, reference)
    assert np.abs([gradients.x, gradients.y]).max() <= STEEPEST + 1e-5
    assert not gradients.valid.all()


def test_a_bundle_measures_as_the_network_that_it_was_made_of(
    tmp_path: Path, images: tuple[Array, Array]
) -> None:
    file = write_torch_file(tmp_path / "nnmodel.pth", random_network(SDK, 1.0))
    model = AngleNetworkImporter().read(file, colour_profile(tmp_path, WIDTH, HEIGHT))
    model.save(tmp_path)
    again = type(model).load(tmp_path)
    np.testing.assert_array_equal(measured(again, *images), measured(model, *images))


def other_size() -> dict[str, Array]:
    return random_network((5, 16, 16, 16, 2))


def not_finite() -> dict[str, Array]:
    return random_network(SDK) | {"fc4.bias": np.array([np.nan, 0], np.float32)}


@pytest.mark.parametrize("importer", [AngleNetworkImporter(), NormalNetworkImporter()])
@pytest.mark.parametrize(
    "saved",
    [
        other_size,
        not_finite,
        lambda: {"conv1.weight": np.zeros((3, 3), np.float32)},
        lambda: {"state_dict": 3},
        lambda: {},
    ],
)
def test_another_network_is_one_sentence(
    tmp_path: Path, importer: Importer, saved: Callable[[], dict[str, Any]]
) -> None:
    for nested in (saved(), {"state_dict": saved()}):
        file = write_torch_file(tmp_path / "other.pt", nested)
        with pytest.raises(InputError, match=r"holds no network like that in .* give such a file"):
            importer.read(file, colour_profile(tmp_path, WIDTH, HEIGHT))


@pytest.fixture(scope="module")
def mini(recordings: Path) -> Path:
    file = recordings / "calibrations" / "gelslam_mini_nnmodel.pth"
    if not file.exists():
        pytest.skip(f"{file} is missing; it is gelslam's nnmodel.pth of gelsight_mini/ball_presses")
    return file


@pytest.mark.recordings
def test_the_network_of_a_real_mini_measures_the_ball_that_pressed_it(
    mini: Path, recordings: Path, tmp_path: Path
) -> None:
    folder = recordings / "gelsight_mini" / "ball_presses"
    for press in folder.glob("press_*.png"):
        shutil.copyfile(press, tmp_path / press.name)
    profile = load_profile(REPOSITORY / "experiments" / "profiles" / "gelsight_mini.yaml")
    reference = folder / "background.png"
    bundle = import_calibration(mini, "imports.gs_sdk", profile, reference=reference)
    found = pressed_balls(profile, bundle, tmp_path, ball_mm=6.31)
    assert len(found) == 22
    slopes = np.concatenate(found)
    true = slopes[:, 2:]
    assert angles_deg(slopes[:, :2], true).mean() < 5
    assert angles_deg(0 * true, true).mean() > 17
    # a sphere's sines are proportional to the distance from its middle: the factor is its radius
    ratios = [
        np.polyfit(sines(one[:, 2:]).ravel(), sines(one[:, :2]).ravel(), 1)[0] for one in found
    ]
    assert np.median(ratios) == pytest.approx(1, abs=0.05)


@pytest.mark.recordings
def test_the_file_of_a_real_mini_gives_the_published_gradients(
    mini: Path, recordings: Path, tmp_path: Path
) -> None:
    folder = recordings / "gelsight_mini" / "ball_presses"
    images = [cv2.imread(str(folder / name)) for name in ("press_20.png", "background.png")]
    frame, background = (np.asarray(image) for image in images)
    model = AngleNetworkImporter().read(mini, colour_profile(tmp_path, 320, 240))
    state = read_torch_file(mini)
    expected = -published_by_gs_sdk(state, frame, background)
    np.testing.assert_allclose(measured(model, frame, background), expected, atol=1e-4)


def sines(slopes: Array) -> Array:
    return np.asarray(slopes / np.sqrt(1 + (slopes**2).sum(axis=1, keepdims=True)))


def pressed_balls(profile: Profile, bundle: Bundle, folder: Path, *, ball_mm: float) -> list[Array]:
    """Return measured and true slopes (N, 4) of the contact of each press."""
    frames = list(read_frames(profile, folder))
    assert bundle.reference is not None
    pipeline = Pipeline(profile, bundle, bundle.reference)
    found = balls(
        profile,
        folder,
        frames,
        pipeline.conditioning,
        ball_diameter_mm=ball_mm,
        progress=Silent(),
    )
    slopes = []
    for press, frame in zip(found.surfaces, frames, strict=True):
        assert press.used, press.file
        gradients = pipeline.process(frame)[Gradients]
        y, x, true = press.true_gradients(press.scored_area())
        slopes.append(np.column_stack([gradients.x[y, x], gradients.y[y, x], true]))
    return slopes
