"""Time from an RGB frame to height and contact, and of its parts: ``make bench``."""

import cv2
import pytest

from tactile_core.calibration.virtual_unit import virtual_unit
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame

STEREO_PROFILE, STEREO = "desktop_six_led_portable", "desktop_six_led.photometric_stereo"


def pipeline(name: str, use: str, size: tuple[int, int]) -> tuple[Pipeline, tuple[Frame, ...]]:
    """A virtual unit, calibrated with ground-truth circles, and its frames."""
    cv2.setNumThreads(1)
    unit = virtual_unit(load_profile(name), size_px=size, model=use)
    return Pipeline(unit.profile, unit.bundle), unit.frames


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1920, 1080)], ids=str)
@pytest.mark.parametrize("use", ["core.mlp", "core.lookup_table"])
@pytest.mark.parametrize("name", ["hex_fingertip_unmarked", "hex_fingertip"])
def bench_rgb_to_height_and_contact(benchmark, name, use, size):
    made, frames = pipeline(name, use, size)
    for frame in frames[:2]:
        made.process(frame)
    benchmark(made.process, frames[1])


@pytest.mark.parametrize("use", ["core.mlp", "core.lookup_table", "core.polynomial"])
def bench_rgb_to_slopes(benchmark, use):
    made, frames = pipeline("hex_fingertip_unmarked", use, (640, 480))
    assert made.bundle is not None
    assert made.reference is not None
    model = made.bundle.calibration
    model.measure(frames[0], made.reference)
    benchmark(model.measure, frames[1], made.reference)


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1920, 1080)], ids=str)
def bench_six_images_to_height_and_contact(benchmark, size):
    made, frames = pipeline(STEREO_PROFILE, STEREO, size)
    made.process(frames[0])
    benchmark(made.process, frames[1])


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1920, 1080)], ids=str)
def bench_six_images_to_slopes(benchmark, size):
    made, frames = pipeline(STEREO_PROFILE, STEREO, size)
    assert made.bundle is not None
    assert made.reference is not None
    model = made.bundle.calibration
    model.measure(frames[0], made.reference)
    benchmark(model.measure, frames[1], made.reference)
