"""The compiled kernels agree with numpy, the reference implementation."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.elasticity import Elastomer
from tactile_core.algorithms.elasticity.elastic_layer import ElasticLayer
from tactile_core.algorithms.elasticity.grid import Grid
from tactile_core.algorithms.kernels import SWITCH
from tactile_core.sim import Faults, VirtualStage, kernels
from tactile_core.sim.friction import Grip, solve_friction
from tactile_core.sim.optics.jpeg import compressed

HEIGHT_MM = 3e-4
"""numpy inverts the displacement with OpenCV, which rounds; version 4 is coarser than 5."""

needs_kernels = pytest.mark.skipif(
    kernels.load() is None, reason="numba is not installed, or TACTILE_FAST is 0"
)


def both_ways(function: Callable[[bool], Any]) -> tuple[Any, Any]:
    """Results of a function with and without the kernels."""
    return function(True), function(False)


def slid(
    name: str, compiled: bool, *, faults: Faults | None = None, optics: Any = None
) -> VirtualStage:
    """A ball that has slid over the gel surface."""
    looks = {"optics": optics or {}}
    stage = VirtualStage(name, 3, overrides=looks, faults=faults, compiled=compiled)
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
def test_a_frame_is_the_same_within_a_grey_level(name: str, faults: Faults | None) -> None:
    sent_whole = {"sensor": {"jpeg_quality": "none"}}
    fast, plain = both_ways(
        lambda compiled: slid(name, compiled, faults=faults, optics=sent_whole).frame().pixels
    )
    apart = np.abs(fast.astype(int) - plain)
    assert apart.max() <= 1
    assert np.count_nonzero(apart) < 2e-3 * apart.size


@needs_kernels
def test_compression_keeps_that_difference_small() -> None:
    fast, plain = both_ways(lambda compiled: slid("hex_fingertip", compiled).frame().pixels)
    assert np.abs(fast.astype(float) - plain).mean() < 0.01


@needs_kernels
@pytest.mark.parametrize("quality", [1, 50, 90, 100])
@pytest.mark.parametrize("shape", [(16, 16), (48, 800), (40, 36)])
def test_compression_without_coding_is_jpeg_bit_by_bit(
    quality: int, shape: tuple[int, int]
) -> None:
    rng = np.random.default_rng(quality)
    y, x = np.indices(shape)
    smooth = 120 + 90 * np.sin(np.stack([x / 9, y / 7, (x + y) / 5], -1))
    extreme = rng.choice([0, 255], (*shape, 3))
    for pixels in (smooth + rng.normal(0, 5, smooth.shape), extreme):
        sent = np.clip(pixels, 0, 255).astype(np.uint8)
        fast, plain = both_ways(
            lambda compiled, sent=sent: compressed(sent, quality, kernels.chosen(compiled))
        )
        np.testing.assert_array_equal(fast, plain)


@needs_kernels
def test_rendered_height_and_displacement_are_the_truth() -> None:
    stage = slid("hex_fingertip", True)
    height_mm, displacement_mm = stage.seen(kernels.load())
    truth = stage.truth()
    np.testing.assert_allclose(height_mm, truth.height_mm, atol=HEIGHT_MM)
    np.testing.assert_allclose(displacement_mm, truth.displacement_mm, atol=HEIGHT_MM)


@needs_kernels
@given(
    window=st.tuples(st.integers(2, 12), st.integers(2, 12)),
    free_slip_mm=st.sampled_from([0.0, 0.01]),
    seed=st.integers(0, 1000),
)
@settings(max_examples=15, deadline=None)
def test_friction_holds_the_same_displacement(
    window: tuple[int, int], free_slip_mm: float, seed: int
) -> None:
    layer = ElasticLayer(Grid(40, 36, 0.2), Elastomer(2.0, 0.145, 0.48)).near(window)
    rng = np.random.default_rng(seed)
    wanted = rng.normal(0, 0.05, (2, *window)).astype(np.float32)
    limit = np.maximum(rng.normal(0, 0.05, window), 0).astype(np.float32)
    fast, plain = both_ways(
        lambda compiled: solve_friction(
            layer,
            wanted,
            limit,
            Grip.none(window, np.float32),
            free_slip_mm=free_slip_mm,
            max_iterations=5,
            compiled=kernels.chosen(compiled),
        )
    )
    assert fast.iterations == plain.iterations
    assert fast.resolution_mm == pytest.approx(plain.resolution_mm, rel=1e-4)
    np.testing.assert_allclose(fast.traction, plain.traction, atol=1e-5)
    np.testing.assert_allclose(fast.slip_mm, plain.slip_mm, atol=1e-5)
    np.testing.assert_array_equal(fast.slip_mm == 0, plain.slip_mm == 0)


@needs_kernels
@pytest.mark.parametrize("shape", ["round", "square", "triangle"])
def test_markers_of_every_shape_are_drawn_equally(shape: str) -> None:
    looks = {"markers": {"shape": shape, "layout": "quasi_random"}}

    def printed(compiled: bool) -> np.ndarray:
        merged = Faults(merged_markers=0.2)
        stage = VirtualStage(
            "hex_fingertip", 1, overrides={"optics": looks}, faults=merged, compiled=compiled
        )
        optics = stage._optics
        level = np.zeros(stage.truth().height_mm.shape, np.float32)
        surface = optics.surface(level, None, optics.markers_px + 0.3)
        assert surface.reflectance is not None
        return surface.reflectance

    fast, plain = both_ways(printed)
    np.testing.assert_allclose(fast, plain, atol=1e-5)


def imports_numba(choice: str) -> bool:
    code = (
        "import sys; from tactile_core.sim import VirtualStage\n"
        f"VirtualStage('hex_fingertip'{choice}).frame()\n"
        "print('numba' in sys.modules)"
    )
    environment = {**os.environ, SWITCH: "1"}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return run.stdout.strip() == "True"


@needs_kernels
def test_a_stage_loads_numba_unless_it_is_disabled() -> None:
    assert imports_numba("")
    assert not imports_numba(", compiled=False")
