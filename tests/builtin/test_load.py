"""``core.load``: a load without calibration, on virtual rigs and on recorded grips."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.relative_load import clips, correlations
from tactile_core.builtin.contact import THICKNESS_SHARE, Load
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Reference, RelativeLoad
from tactile_sim.stage import VirtualStage

SIZE = {"image": {"width_px": 320, "height_px": 240, "mm_per_px": 0.0552}}
STEPS = {"estimators": {"load": {"use": "core.load"}}}


@pytest.fixture(scope="module")
def stage() -> VirtualStage:
    return VirtualStage("hex_fingertip", seed=0, mode="fast", overrides=SIZE)


@pytest.fixture
def pipeline(stage: VirtualStage) -> Pipeline:
    stage.reset()
    frames = [stage.frame() for _ in range(5)]
    pixels = np.asarray(np.mean([frame.pixels for frame in frames], axis=0), np.float32)
    reference = Reference(pixels, frames[0].channels, frames=5)
    return Pipeline(
        load_profile("hex_fingertip", sim=True, overrides=SIZE | STEPS), None, reference
    )


def load(pipeline: Pipeline, frame: Frame) -> float:
    return pipeline.process(frame)[RelativeLoad].load


def test_it_needs_no_bundle_and_ends_up_in_the_json_line(
    stage: VirtualStage, pipeline: Pipeline
) -> None:
    line = pipeline.process(replace(stage.frame(), timestamp_s=1.5)).summary()
    assert isinstance(line["load"], float)
    assert line["timestamp_s"] == 1.5


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [("sphere", {"diameter_mm": 12.0}), ("flat", {"diameter_mm": 5.0})],
)
def test_it_grows_with_the_force_under_any_light(
    stage: VirtualStage, pipeline: Pipeline, kind: str, sizes: dict[str, float]
) -> None:
    frames = [stage.frame()]
    stage.indenter(kind, **sizes)
    for force_n in (0.5, 1.0, 2.0, 4.0):
        stage.press(force_n=force_n)
        frames.append(stage.frame())
    loads = [load(pipeline, frame) for frame in frames]
    assert (np.diff(loads) > 0).all()
    assert abs(loads[0]) < 0.1 * loads[2]
    darker = [replace(frame, pixels=(0.9 * frame.pixels).astype(np.uint8)) for frame in frames]
    np.testing.assert_allclose(
        [load(pipeline, frame) for frame in darker], loads, rtol=0.05, atol=0.1 * loads[2]
    )


def test_a_tare_subtracts_the_load_until_the_reset(stage: VirtualStage, pipeline: Pipeline) -> None:
    stage.indenter("sphere", diameter_mm=12.0)
    stage.press(depth_mm=0.3)
    frame = stage.frame()
    whole = load(pipeline, frame)
    assert pipeline.process(frame, tare=True)[RelativeLoad].load == 0
    assert load(pipeline, frame) == 0
    pipeline.reset()
    assert load(pipeline, frame) == whole


def test_a_gel_of_unknown_thickness_is_taken_as_a_share_of_the_view() -> None:
    profile = load_profile("hex_fingertip")
    rng = np.random.default_rng(0)
    pixels = rng.integers(90, 110, (480, 640, 3)).astype(np.uint8)
    reference = Reference(np.full(pixels.shape, 100, np.float32), ("red", "green", "blue"))
    frame = Frame(pixels, reference.channels, profile.image.mm_per_px)
    share_mm = THICKNESS_SHARE * 640 * profile.image.mm_per_px

    def found(thickness_mm: float | None) -> float:
        gel = profile.gel.model_copy(update={"thickness_mm": thickness_mm})
        return Load(Options(), SensorContext(profile.image, gel)).estimate(frame, reference).load

    assert found(None) == pytest.approx(found(share_mm))


def test_it_follows_the_force_of_recorded_grips(recordings: Path) -> None:
    grips = clips(recordings, "green_ball_softer_[12]")
    assert len(grips) == 2
    for clip in grips:
        assert min(correlations(clip, clip.loads)) > 0.98, clip.name
