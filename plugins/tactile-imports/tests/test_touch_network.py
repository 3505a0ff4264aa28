"""TouchNet measures what py3DCal computes, in our axes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from support.colour_profile import colour_profile
from support.torch_files import write_torch_file

from tactile_core import Frame, InputError, Reference
from tactile_core.interfaces.importer import Importer
from tactile_imports.touch_network import (
    TouchNetwork,
    TouchNetworkBgrImporter,
    TouchNetworkImporter,
    convolve,
)

Array = np.ndarray[Any, Any]

HEIGHT, WIDTH = 12, 16
NAMES = ("red", "green", "blue")
LAYERS = (
    (5, 32, 7),
    (32, 64, 7),
    (64, 128, 7),
    (128, 256, 5),
    (256, 256, 5),
    (256, 128, 5),
    (128, 64, 3),
    (64, 32, 3),
    (32, 2, 1),
)
"""Channels before and after each convolution, and the side of its kernel."""


def random_state() -> dict[str, Array]:
    """Return a state by PyTorch's names; the outputs are a few tenths in size."""
    rng = np.random.default_rng(0)
    state: dict[str, Array] = {}
    for number, (before, after, side) in enumerate(LAYERS, 1):
        scale = np.sqrt(2 / (before * side * side))
        state[f"conv{number}.weight"] = rng.normal(0, scale, (after, before, side, side))
        state[f"conv{number}.bias"] = rng.normal(0, 0.05, after)
        if number < len(LAYERS):
            state[f"bn{number}.weight"] = rng.uniform(0.7, 1.3, after)
            state[f"bn{number}.bias"] = rng.normal(0, 0.1, after)
            state[f"bn{number}.running_mean"] = rng.normal(0, 0.1, after)
            state[f"bn{number}.running_var"] = rng.uniform(0.5, 1.5, after)
    state["conv1.weight"][:, 3:] /= 20  # positions are many times larger than changes of colour
    single = {name: array.astype(np.float32) for name, array in state.items()}
    return single | {"bn1.num_batches_tracked": np.array(1200, np.int64)}


def published(state: dict[str, Array], image: Array, background: Array) -> Array:
    """Return py3DCal's slopes (2, H, W) of images (H, W, 3) as it stores them, in float64."""
    height, width = image.shape[:2]
    change = image / 255 - background / 255
    column, row = np.meshgrid(np.arange(1, width + 1), np.arange(1, height + 1))
    z = np.concatenate([np.moveaxis(change, 2, 0), [column, row]])
    for number, (_, _, side) in enumerate(LAYERS, 1):
        margin = side // 2
        padded = np.pad(z, ((0, 0), (margin, margin), (margin, margin)))
        windows = sliding_window_view(padded, (side, side), axis=(1, 2))
        z = np.tensordot(
            state[f"conv{number}.weight"].astype(float), windows, ((1, 2, 3), (0, 3, 4))
        )
        z += state[f"conv{number}.bias"][:, None, None]
        if number < len(LAYERS):
            gain, offset, mean, variance = (
                state[f"bn{number}.{part}"].astype(float)[:, None, None]
                for part in ("weight", "bias", "running_mean", "running_var")
            )
            z = np.maximum((z - mean) / np.sqrt(variance + 1e-5) * gain + offset, 0)
    return z


@pytest.fixture(scope="module")
def images() -> tuple[Array, Array]:
    """Return a frame and a background in red, green, blue."""
    rng = np.random.default_rng(1)
    frame, background = rng.integers(20, 235, (2, HEIGHT, WIDTH, 3), np.uint8)
    return frame, background


def measured(model: TouchNetwork, frame: Array, background: Array) -> Array:
    gradients = model.measure(
        Frame(frame, NAMES, 0.0634), Reference(background.astype(np.float32), NAMES)
    )
    assert gradients.valid.all()
    return np.stack([gradients.x, gradients.y])


def imported(folder: Path, importer: TouchNetworkImporter) -> TouchNetwork:
    return importer.read(
        write_torch_file(folder / "weights.pth", random_state()),
        colour_profile(folder, WIDTH, HEIGHT),
    )


@pytest.mark.parametrize("order", ["rgb", "bgr"])
def test_the_network_gives_its_slopes_with_our_sign(
    tmp_path: Path, images: tuple[Array, Array], order: str
) -> None:
    model = imported(
        tmp_path, TouchNetworkImporter() if order == "rgb" else TouchNetworkBgrImporter()
    )
    # what py3DCal stores is mirrored
    stored = [image[:, ::-1, :: 1 if order == "rgb" else -1] for image in images]
    x, y = published(random_state(), *stored)[:, :, ::-1]
    # its x points the other way, and its heights are depths
    expected = np.stack([x, -y])
    assert np.abs(expected).max() > 0.2
    np.testing.assert_allclose(measured(model, *images), expected, atol=1e-4)


def seer() -> dict[str, Array]:
    """Return the state of a network that puts out four times the change of red and of green."""
    state = {name: np.zeros_like(array) for name, array in random_state().items()}
    for number, (_, _, side) in enumerate(LAYERS, 1):
        middle = state[f"conv{number}.weight"][:, :, side // 2, side // 2]
        if number == 1:  # what is positive and what is negative, for ReLU passes only one of them
            middle[:4, :2] = [[1, 0], [-1, 0], [0, 1], [0, -1]]
        elif number < len(LAYERS):
            middle[:4, :4] = np.eye(4)
        else:
            middle[:, :4] = [[4, -4, 0, 0], [0, 0, 4, -4]]
        if number < len(LAYERS):
            state[f"bn{number}.weight"][:] = 1
            state[f"bn{number}.running_var"][:] = 1 - 1e-5
    return state


def test_a_network_that_has_learned_its_target_measures_the_dome_of_a_ball(tmp_path: Path) -> None:
    """What py3DCal trains for: (x - c) / sqrt(r^2 - d^2) in the mirrored image, likewise for y."""
    radius, centre = 30.0, (4.0, 7.0)
    x, y = np.meshgrid(np.arange(WIDTH) - centre[0], np.arange(HEIGHT) - centre[1])
    dome = np.sqrt(radius**2 - x**2 - y**2)  # our heights, in px: highest under the ball
    mirrored = np.arange(WIDTH) - (WIDTH - 1 - centre[0])
    target = np.stack([mirrored / dome[:, ::-1], y / dome[:, ::-1]], axis=2)
    background = np.full((HEIGHT, WIDTH, 3), 100, np.float32)
    change = np.dstack([target, 0 * x])[:, ::-1] / 4 * 255
    file = write_torch_file(tmp_path / "weights.pth", seer())
    model = TouchNetworkImporter().read(file, colour_profile(tmp_path, WIDTH, HEIGHT))
    slopes = measured(model, (background + change).astype(np.float32), background)
    dy, dx = np.gradient(dome)
    np.testing.assert_allclose(slopes[:, 1:-1, 1:-1], [dx[1:-1, 1:-1], dy[1:-1, 1:-1]], atol=2e-3)


def test_a_bundle_measures_as_the_network_that_it_was_made_of(
    tmp_path: Path, images: tuple[Array, Array]
) -> None:
    model = imported(tmp_path, TouchNetworkImporter())
    model.save(tmp_path)
    again = TouchNetwork.load(tmp_path)
    np.testing.assert_array_equal(measured(again, *images), measured(model, *images))


def test_a_convolution_takes_zeros_beyond_the_border() -> None:
    image = np.ones((1, 4, 5), np.float32)
    box = np.ones((1, 1, 3, 3), np.float32)
    (total,) = convolve(image, box, np.zeros(1, np.float32))
    np.testing.assert_array_equal(total[[0, 0, 1, 3], [0, 2, 2, 4]], [4, 6, 9, 4])


def other_kernel() -> dict[str, Array]:
    return random_state() | {"conv4.weight": np.zeros((256, 128, 3, 3), np.float32)}


def not_finite() -> dict[str, Array]:
    return random_state() | {"conv9.bias": np.array([np.nan, 0], np.float32)}


def negative_variance() -> dict[str, Array]:
    return random_state() | {"bn8.running_var": np.full(32, -1, np.float32)}


def no_normalisation() -> dict[str, Array]:
    return {name: array for name, array in random_state().items() if not name.startswith("bn")}


@pytest.mark.parametrize("importer", [TouchNetworkImporter(), TouchNetworkBgrImporter()])
@pytest.mark.parametrize(
    "saved", [other_kernel, not_finite, negative_variance, no_normalisation, dict]
)
def test_another_network_is_one_sentence(tmp_path: Path, importer: Importer, saved: Any) -> None:
    file = write_torch_file(tmp_path / "other.pth", saved())
    with pytest.raises(InputError, match=r"no network like py3DCal's TouchNet.*give such a file"):
        importer.read(file, colour_profile(tmp_path, WIDTH, HEIGHT))


def test_a_file_that_names_a_class_is_refused_and_not_run(tmp_path: Path) -> None:
    # torch.save(network, FILE), in place of its state
    pickled = b"\x80\x02cpy3DCal.model_training.models.touchnet\nTouchNet\n."
    file = write_torch_file(tmp_path / "whole.pth", {}, pickled=pickled)
    with pytest.raises(InputError, match=r"names py3DCal.*TouchNet.*network\.state_dict\(\)"):
        TouchNetworkImporter().read(file, colour_profile(tmp_path, WIDTH, HEIGHT))
