"""The compiled kernels show what numpy shows, which is the definition."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tactile_core.algorithms.kernels import SWITCH
from tactile_core.sim import Faults, VirtualStage, kernels

HEIGHT_MM = 3e-4
"""numpy finds where the surface came from with OpenCV, which rounds: 4 more coarsely than 5."""

needs_kernels = pytest.mark.skipif(
    kernels.load() is None, reason="numba is not installed, or TACTILE_FAST is 0"
)
BothWays = Callable[[Callable[[], Any]], tuple[Any, Any]]


@pytest.fixture
def both_ways(monkeypatch: pytest.MonkeyPatch) -> BothWays:
    """What a function returns with the kernels, and without."""

    def call(function: Callable[[], Any]) -> tuple[Any, Any]:
        compiled = function()
        with monkeypatch.context() as patch:
            patch.setattr(kernels, "load_for", lambda frame: None)
            return compiled, function()

    return call


def slid(name: str, *, faults: Faults | None = None, optics: Any = None) -> VirtualStage:
    """A ball that has slid over a rig; the next frame is not its first."""
    stage = VirtualStage(name, 3, overrides={"optics": optics or {}}, faults=faults)
    stage.frame()
    stage.indenter("sphere", diameter_mm=5.0, x_mm=-1.0)
    stage.press(depth_mm=0.4, steps=2)
    stage.shear(dx_mm=0.4, dy_mm=0.1, steps=3)
    return stage


@needs_kernels
@pytest.mark.parametrize(
    ("name", "faults"),
    [
        ("hex_fingertip", None),
        ("hex_fingertip_domed", None),
        ("baxter_fingertip", None),
        ("desktop_six_led", Faults(scratches=5, dust=5)),
    ],
)
def test_a_frame_is_the_same_within_a_grey_level(
    both_ways: BothWays, name: str, faults: Faults | None
) -> None:
    sent_whole = {"sensor": {"jpeg_quality": "none"}}
    fast, plain = both_ways(lambda: slid(name, faults=faults, optics=sent_whole).frame().pixels)
    apart = np.abs(fast.astype(int) - plain)
    assert apart.max() <= 1
    assert np.count_nonzero(apart) < 2e-3 * apart.size


@needs_kernels
def test_compression_keeps_that_difference_small(both_ways: BothWays) -> None:
    fast, plain = both_ways(lambda: slid("hex_fingertip").frame().pixels)
    assert np.abs(fast.astype(float) - plain).mean() < 0.01


@needs_kernels
def test_what_the_camera_sees_is_the_truth() -> None:
    stage = slid("hex_fingertip")
    height_mm, displacement_mm = stage.seen(kernels.load())
    truth = stage.truth()
    np.testing.assert_allclose(height_mm, truth.height_mm, atol=HEIGHT_MM)
    np.testing.assert_allclose(displacement_mm, truth.displacement_mm, atol=HEIGHT_MM)


@needs_kernels
@pytest.mark.parametrize("shape", ["round", "square", "triangle"])
def test_marks_of_every_shape_are_drawn_alike(both_ways: BothWays, shape: str) -> None:
    looks = {"marks": {"shape": shape, "layout": "quasi_random"}}

    def printed() -> np.ndarray:
        stage = VirtualStage("hex_fingertip", 1, overrides={"optics": looks})
        optics = stage._optics
        level = np.zeros(stage.truth().height_mm.shape, np.float32)
        skin = optics.skin(level, None, optics.markers_px + 0.3, frame=1)
        assert skin.reflectance is not None
        return skin.reflectance

    fast, plain = both_ways(printed)
    np.testing.assert_allclose(fast, plain, atol=1e-5)


@needs_kernels
def test_the_first_frame_is_the_same_whoever_has_loaded_the_kernels(both_ways: BothWays) -> None:
    fast, plain = both_ways(lambda: VirtualStage("hex_fingertip").frame().pixels)
    np.testing.assert_array_equal(fast, plain)


def imports_numba(frames: int) -> bool:
    code = (
        "import sys; from tactile_core.sim import VirtualStage; s = VirtualStage('hex_fingertip')\n"
        f"for _ in range({frames}): s.frame()\n"
        "print('numba' in sys.modules)"
    )
    environment = {**os.environ, SWITCH: ""}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return run.stdout.strip() == "True"


@needs_kernels
def test_a_single_frame_does_not_import_numba() -> None:
    assert not imports_numba(1)
    assert imports_numba(2)
