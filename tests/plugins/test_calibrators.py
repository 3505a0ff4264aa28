"""Calibrators that violate their interface are reported by name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest

from tactile_core.errors import PluginFault
from tactile_core.interfaces.calibration import Calibration, Calibrator, Press
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.illumination import Light
from tactile_core.plugins.options import (
    calibrator_of,
    fitted_by,
    smoothing_px_of,
    uncalibrated_by,
)
from tactile_core.quantities import Frame, Gradients, Reference

REFERENCE = Reference(np.ones((4, 6, 3), np.float32), ("red", "green", "blue"))


class Own(Calibration):
    compensation = "none"

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        raise NotImplementedError

    def save(self, directory: Path) -> None:
        raise NotImplementedError

    @classmethod
    def load(cls, directory: Path) -> Self:
        raise NotImplementedError


class FakeCalibrator(Calibrator):
    """Returns any value that a test sets."""

    returned: Any = None

    def fit(self, presses: Sequence[Press], reference: Reference) -> Calibration:
        return self.returned  # type: ignore[no-any-return]

    def from_lights(self, lights: Sequence[Light]) -> Calibration | None:
        return self.returned  # type: ignore[no-any-return]

    def smoothing_px(self, mm_per_px: float) -> float:
        return self.returned  # type: ignore[no-any-return]


@pytest.fixture
def calibrator() -> FakeCalibrator:
    return FakeCalibrator(FakeCalibrator.Options())


def test_a_result_that_is_not_a_calibration_is_rejected(calibrator: FakeCalibrator) -> None:
    calibrator.returned = "a model"
    with pytest.raises(PluginFault, match=r"FakeCalibrator.* fitted str, not a Calibration"):
        fitted_by(calibrator, [], REFERENCE)
    with pytest.raises(PluginFault, match="made str from lights, not a Calibration"):
        uncalibrated_by(calibrator, [])


def test_a_model_with_another_compensation_than_its_calibrator_is_rejected(
    calibrator: FakeCalibrator,
) -> None:
    calibrator.returned = Own()
    with pytest.raises(PluginFault, match="'channel', but its model Own measures with 'none'"):
        fitted_by(calibrator, [], REFERENCE)


@pytest.mark.parametrize("smoothing", [np.nan, np.inf, -1.0, "wide"])
def test_an_invalid_smoothing_width_is_rejected(
    calibrator: FakeCalibrator, smoothing: object
) -> None:
    calibrator.returned = smoothing
    with pytest.raises(PluginFault):
        smoothing_px_of(calibrator, 0.1)


def test_smoothing_is_zero_by_default() -> None:
    class Plain(Calibrator):
        def fit(self, presses: Sequence[Press], reference: Reference) -> Calibration:
            return Own()

    plain = Plain(Plain.Options())
    assert smoothing_px_of(plain, 0.1) == 0
    assert uncalibrated_by(plain, []) is None


def test_a_calibrator_gets_the_options_of_the_profile() -> None:
    made = calibrator_of(Component.model_validate({"use": "core.polynomial", "blur_mm": 0.3}))
    assert made.smoothing_px(0.1) == pytest.approx(3.0)
