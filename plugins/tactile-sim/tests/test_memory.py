"""Memory of a virtual rig stays constant over any number of frames."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from itertools import count, islice
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.soak import share_of

from tactile_core.profiles.loader import load_profile
from tactile_sim import VirtualStage

STATUS = Path("/proc/self/status")

WARM_UP = 300
"""Frames with each kind and size of contact once: more than the twelve turns that repeat."""

FLAT_MIB = 8.0
"""Memory of ten frames; the test takes thousands."""


def resident_mib() -> float:
    """Current memory of this process."""
    lines = STATUS.read_text().splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024


def handled(stage: VirtualStage) -> Iterator[None]:
    """Press, shear, twist, roll, hold and release in a loop; one motion per frame."""
    for turn in count():
        size = 3.0 + turn % 4
        if turn % 3:
            stage.indenter("sphere", diameter_mm=size, x_mm=0.5 * (turn % 5 - 2))
        else:
            stage.indenter("flat", diameter_mm=size, y_mm=0.5 * (turn % 5 - 2))
        for depth in (0.1, 0.2, 0.3):
            stage.press(depth_mm=depth, steps=1, seconds=0.03)
            yield
        for step in range(15):
            stage.shear(dx_mm=0.1, dy_mm=0.02 * (turn % 3), seconds=0.03)
            yield
            if step % 5 == 0:
                stage.twist(1.0, seconds=0.03)
                yield
        stage.hold(0.03)
        yield
        stage.release(0.03)
        yield
        stage.release()
        yield


def grown_mib(stage: VirtualStage, frames: int) -> float:
    before = np.nan
    for number, _ in zip(range(WARM_UP + frames), handled(stage), strict=False):
        if number == WARM_UP:
            before = resident_mib()
        pixels = stage.frame().pixels
        cv2.imencode(".jpg", np.ascontiguousarray(pixels[..., :3]))
        if number % 10 == 0:
            assert stage.truth().height_mm.shape == pixels.shape[:2]
    return resident_mib() - before


@pytest.mark.parametrize("profile", ["hex_fingertip", "desktop_six_led"])
def test_a_frame_is_freed_at_once_not_when_python_looks_for_cycles(profile: str) -> None:
    stage = VirtualStage(profile)
    motions = handled(stage)
    next(motions)
    stage.frame()
    gc.collect()
    gc.disable()
    try:
        for _ in islice(motions, 60):  # three contacts
            stage.frame()
        assert gc.collect() == 0
    finally:
        gc.enable()


needs_proc = pytest.mark.skipif(not STATUS.exists(), reason="reads /proc, which Linux has")


@needs_proc
def test_memory_stays_flat() -> None:
    # half the resolution, as twice the frames are worth more than four times the pixels
    image = load_profile("hex_fingertip").image
    small = {
        "width_px": image.width_px // 2,
        "height_px": image.height_px // 2,
        "mm_per_px": 2 * image.mm_per_px,
    }
    assert grown_mib(VirtualStage("hex_fingertip", overrides={"image": small}), 200) < FLAT_MIB


@needs_proc
@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("profile", ["hex_fingertip", "desktop_six_led"])
def test_memory_stays_flat_over_ten_thousand_frames(profile: str) -> None:
    frames = share_of(10_000)
    grown = grown_mib(VirtualStage(profile), frames)
    print(f"{profile}: {grown:+.1f} MiB over {frames} frames")
    assert grown < FLAT_MIB
