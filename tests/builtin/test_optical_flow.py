"""Optical flow on a virtual gel without markers, compared with ground truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core import DisplacementField
from tactile_core.builtin.optical_flow import OpticalFlow
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.quantities import Frame, Reference
from tactile_sim import VirtualStage
from tactile_sim.truth import TrueState


class Bare:
    """A virtual gel without markers, and the step under test."""

    def __init__(self, kind: str, depth_mm: float, *, friction: float = 3.0, **options: float):
        self.stage = VirtualStage(
            "hex_fingertip_unmarked", seed=2, overrides={"gel": {"friction": friction}}
        )
        frame = self.stage.frame()
        self.undeformed = Reference(
            frame.pixels.astype(np.float32), frame.channels, frame.full_scale
        )
        profile = self.stage.profile
        self.step = OpticalFlow(OpticalFlow.Options(), SensorContext(profile.image, profile.gel))
        self.step.estimate(frame, self.undeformed)
        self.stage.indenter(kind, **options)
        for part in (0.4, 0.7, 1.0):
            self.stage.press(part * depth_mm)
            self.measured()

    def measured(self, light: float = 1.0) -> tuple[DisplacementField, TrueState]:
        frame = self.stage.frame()
        return self.step.estimate(_lit(frame, light), self.undeformed), self.stage.truth()


def _lit(frame: Frame, light: float) -> Frame:
    return replace(frame, pixels=np.clip(frame.pixels * light, 0, 255).astype(frame.pixels.dtype))


def _mean(displacement_mm: NDArray[np.float32], truth: TrueState) -> float:
    return float(np.linalg.norm(displacement_mm[truth.contact], axis=1).mean())


@pytest.mark.parametrize("kind", ["coin", "cloth"])
def test_a_textured_contact_is_tracked_over_two_millimetres(kind: str) -> None:
    bare = Bare(kind, 0.25)
    for step in range(10):
        bare.stage.shear(0.16, 0.12)
        field, truth = bare.measured(light=1 + 0.01 * step)
    assert _mean(truth.displacement_mm, truth) > 1.5
    # at the edges of the object the gel surface is stretched to several times its length
    assert _mean(field.mm - truth.displacement_mm, truth) < 0.22 * _mean(
        truth.displacement_mm, truth
    )
    assert field.valid[truth.contact].mean() > 0.5


def test_tare_sets_the_displacement_to_zero() -> None:
    bare = Bare("cloth", 0.25)
    for _ in range(3):
        bare.stage.shear(0.1)
        field, truth = bare.measured()
    again = bare.step.tare(field)
    assert _mean(again.mm, truth) < 0.01
    bare.stage.shear(-0.1)
    field, truth = bare.measured()
    assert field.mm[truth.contact, 0].mean() == pytest.approx(-0.09, abs=0.02)


def test_the_field_is_zero_after_release() -> None:
    bare = Bare("coin", 0.25)
    bare.stage.shear(0.2)
    bare.measured()
    bare.stage.release()
    field, _ = bare.measured()
    assert np.linalg.norm(field.mm, axis=2).mean() < 0.03
    assert not field.valid.any()


def test_a_smooth_object_gives_an_invalid_field() -> None:
    bare = Bare("sphere", 0.4, diameter_mm=12.0)
    bare.stage.shear(0.2)
    field, truth = bare.measured()
    assert field.valid[truth.contact].mean() < 0.5
