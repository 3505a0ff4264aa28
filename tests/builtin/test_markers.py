"""``core.markers``: detection from a frame, or from the marker contrast of its mask."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactile_core import Pipeline
from tactile_core.builtin.contact import MarkerDetection
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    DisplacementField,
    Frame,
    ImprintMotion,
    MarkerDetections,
    MarkerField,
    Reference,
)
from tactile_sim.optics import RigOptics
from tactile_sim.stage import VirtualStage

CHAIN = {"estimators": {"markers": {"use": "core.markers"}, "height": None, "contact": None}}


def rig(**overrides: object) -> tuple[Profile, Frame]:
    profile = load_profile("hex_fingertip", sim=True, overrides=CHAIN | overrides)
    shape = (profile.image.height_px, profile.image.width_px)
    optics = RigOptics(profile, seed=2)
    pixels = optics.expose(np.zeros(shape))
    return profile, Frame(pixels, optics.channels, profile.image.mm_per_px, timestamp_s=3.5)


def reference_of(frame: Frame) -> Reference:
    return Reference(np.asarray(frame.pixels, np.float32), frame.channels)


def test_the_pipeline_computes_the_marker_contrast_once() -> None:
    profile, frame = rig()
    reading = Pipeline(profile).process(frame)
    markers = reading[MarkerDetections]
    assert len(markers.centres_px) == 192
    assert markers.timestamp_s == 3.5
    alone = MarkerDetection(
        MarkerDetection.Options(), SensorContext(profile.image, profile.gel)
    ).estimate(frame)
    np.testing.assert_array_equal(markers.centres_px, alone.centres_px)
    assert reading.frame.marker_contrast is not None
    erased = replace(reading.frame, marker_contrast=np.zeros_like(reading.frame.marker_contrast))
    context = SensorContext(profile.image, profile.gel)
    assert not len(MarkerDetection(MarkerDetection.Options(), context).estimate(erased).centres_px)


def test_pitch_and_diameter_are_found_with_auto() -> None:
    profile, frame = rig(gel={"markers": "auto"})
    reading = Pipeline(profile, reference=reference_of(frame)).process(frame)
    assert len(reading[MarkerDetections].centres_px) == 14 * 10


@pytest.mark.parametrize("ink", [1.4, 2.0])
def test_white_markers_show_the_same_displacement_as_black_ones(ink: float) -> None:
    white = {"gel": {"markers": {"tone": "bright"}}, "optics": {"coat": {"ink": ink}}}
    fields, changes = [], []
    for look in ({}, white):
        stage = VirtualStage("hex_fingertip", seed=3, overrides=look)
        pipeline = Pipeline(stage.profile, reference=reference_of(stage.frame()))
        stage.indenter("sphere", diameter_mm=8, x_mm=0.5, y_mm=-0.4)
        stage.press(depth_mm=0.4)
        still = [pipeline.process(stage.frame()) for _ in range(4)]
        assert len(still[-1][MarkerField].px) == 192
        for _ in range(6):
            stage.shear(0.06, 0.04)
            reading = pipeline.process(stage.frame())
        fields.append(reading[DisplacementField].mm)
        changes.append(reading[ImprintMotion].changed)
    black_mm, white_mm = fields
    assert changes[0] > 0.001
    assert changes[1] == pytest.approx(changes[0], rel=0.25)
    off_mm = np.sqrt(np.mean((white_mm - black_mm) ** 2))
    assert off_mm < 0.015 * np.abs(black_mm).max()


def test_a_gel_without_markers_gives_no_detections() -> None:
    profile, frame = rig()
    step = MarkerDetection(MarkerDetection.Options(), SensorContext(profile.image, Gel()))
    assert step.estimate(frame).centres_px.shape == (0, 2)


def test_markers_that_are_not_found_must_be_given() -> None:
    profile, _ = rig()
    context = SensorContext(profile.image, Gel(markers="auto"))
    with pytest.raises(
        InputError, match="finds no lattice of markers in the reference; give their"
    ):
        MarkerDetection(MarkerDetection.Options(), context)
