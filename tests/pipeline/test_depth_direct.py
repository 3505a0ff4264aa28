"""A pipeline with a calibration that measures height directly."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest

from tactile_core.bundles.bundle import Bundle
from tactile_core.bundles.manifest import Manifest
from tactile_core.interfaces.calibration import Calibration
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap, Reference

WIDTH, HEIGHT, MM_PER_PX = 40, 30, 0.1
CHANNELS = "red", "green", "blue"


class Even(Calibration):
    """Measures the same height everywhere."""

    def measure(self, frame: Frame, reference: Reference) -> HeightMap:
        mm = np.full(frame.pixels.shape[:2], 0.25, np.float32)
        return HeightMap(mm, mm > 0, frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        raise NotImplementedError

    @classmethod
    def load(cls, directory: Path) -> Self:
        raise NotImplementedError


def pipeline(gel: dict[str, Any], **steps: str) -> Pipeline:
    profile = Profile.model_validate(
        {
            "schema": 1,
            "name": "deep",
            "image": {"width_px": WIDTH, "height_px": HEIGHT, "mm_per_px": MM_PER_PX},
            "gel": gel,
            "estimators": {name: {"use": use} for name, use in steps.items()},
        }
    )
    manifest = Manifest(
        profile="deep",
        artefacts={"light": "ourlab.even"},
        image_size_px=(WIDTH, HEIGHT),
        channels=CHANNELS,
        mm_per_px=MM_PER_PX,
    )
    reference = Reference(np.full((HEIGHT, WIDTH, 3), 120, np.float32), CHANNELS)
    return Pipeline(profile, Bundle(manifest, {"light": Even()}, reference))


def frame() -> Frame:
    return Frame(np.full((HEIGHT, WIDTH, 3), 120, np.uint8), CHANNELS, MM_PER_PX)


def test_steps_before_the_height_are_left_out_with_a_warning() -> None:
    made = pipeline({}, height="core.poisson", contact="core.contact")
    first, second = made.process(frame()), made.process(frame())
    assert first[HeightMap].mm.max() == np.float32(0.25)
    assert ContactMask in first.quantities
    assert Gradients not in first.quantities
    assert [warning for warning in first.warnings if "'height' needs Gradients" in warning]
    assert not [warning for warning in second.warnings if "Gradients" in warning]


@pytest.mark.parametrize(
    ("gel", "domed"), [({}, False), ({"shape": "dome", "radius_mm": 10.0}, True)]
)
def test_the_pipeline_adds_the_shape_of_the_gel_to_the_height(
    gel: dict[str, Any], domed: bool
) -> None:
    height = pipeline(gel).process(frame())[HeightMap]
    assert (height.rest_mm is not None) == domed
    corner, middle = height.points_mm[0, 0, 2], height.points_mm[HEIGHT // 2, WIDTH // 2, 2]
    assert middle == pytest.approx(-0.25, abs=0.001)
    assert (corner < middle - 0.1) == domed
