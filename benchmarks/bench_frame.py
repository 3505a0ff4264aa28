"""From RGB to height and contact, and its parts: ``make bench``."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tactile_core.acquisition import average
from tactile_core.algorithms.circles import Circle
from tactile_core.bundle import Bundle, Manifest
from tactile_core.calibrating.presses import FoundPress, press_image
from tactile_core.marks import MarkFinder
from tactile_core.pipeline import Pipeline
from tactile_core.plugins import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame
from tactile_core.sim.ball import BallPress, render

CHANNELS = ("red", "green", "blue")
BALL_MM = 3.96


def pipeline(name: str, use: str, size: tuple[int, int]) -> tuple[Pipeline, list[Frame]]:
    """A virtual unit, calibrated at known circles, and frames that it has not seen."""
    cv2.setNumThreads(1)
    profile = load_profile(name)
    width, height = size
    scale = profile.image.mm_per_px * profile.image.width_px / width
    image = profile.image.model_copy(
        update={"width_px": width, "height_px": height, "mm_per_px": scale}
    )
    profile = profile.model_copy(update={"image": image})
    finder = MarkFinder.of(profile)

    def frame(ball: BallPress | None, seed: int) -> Frame:
        truth = (
            np.zeros((height, width)) if ball is None else ball.height_mm((height, width), scale)
        )
        taken = Frame(render(profile, truth, seed=seed), CHANNELS, scale)
        return taken if finder is None else replace(taken, marks=finder.find(taken.pixels))

    reference = average([frame(None, 0)])
    if finder is not None:
        reference = replace(reference, marks=finder.find(reference.pixels))
    rng = np.random.default_rng(0)
    presses = []
    for seed in range(1, 13):
        spot = float(rng.uniform(0.15, 0.85) * width), float(rng.uniform(0.15, 0.85) * height)
        ball = BallPress(spot, BALL_MM, 0.8)
        taken = frame(ball, seed)
        circle = Circle(spot, ball.contact_radius_mm / scale)
        image_ = press_image(taken, reference)
        presses.append(FoundPress("", taken, image_, circle, BALL_MM / 2 / scale))
    cls = resolve("calibration", use)
    model = cls.fit([press.training() for press in presses], reference, cls.Options())
    manifest = Manifest(
        profile=profile.name,
        model=use,
        image_size_px=size,
        channels=CHANNELS,
        mm_per_px=scale,
    )
    frames = [replace(press.frame, marks=None) for press in presses]
    return Pipeline(profile, Bundle(manifest, model, reference)), frames


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
