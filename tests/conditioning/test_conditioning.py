"""A frame is conditioned once, for calibration and measurement."""

from dataclasses import replace

import numpy as np
import pytest
from support.virtual_lab import VirtualLab

from tactile_core import Frame, Pipeline, Reference
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.errors import SequenceError

NAMES = ("red", "green", "blue")


def shown(pixels: np.ndarray, lab: VirtualLab) -> Frame:
    return Frame(pixels, NAMES, lab.profile.image.mm_per_px, source="press")


def conditioning(lab: VirtualLab, *, compensates: bool = True) -> Conditioning:
    reference = Reference(lab.image(None).astype(np.float32), NAMES)
    return Conditioning.for_build(lab.profile, reference, compensates=compensates)


def brighter(lab: VirtualLab) -> Frame:
    pixels = np.rint(lab.image(None) * np.array([1.04, 1.0, 0.97]))
    return shown(np.clip(pixels, 0, 255).astype(np.uint8), lab)


def test_illumination_drift_is_compensated(lab: VirtualLab) -> None:
    apart = conditioning(lab)(brighter(lab)).pixels.astype(float) - lab.image(None)
    assert np.abs(apart.mean(axis=(0, 1))).max() < 0.5


def test_a_model_with_its_own_compensation_gets_the_original_pixels(
    lab: VirtualLab,
) -> None:
    frame = brighter(lab)
    assert conditioning(lab, compensates=False)(frame).pixels is frame.pixels


def test_without_a_reference_nothing_is_compensated(lab: VirtualLab) -> None:
    frame = brighter(lab)
    assert Conditioning.for_build(lab.profile, None, compensates=True)(frame).pixels is frame.pixels


def test_a_pipeline_measures_the_frame_that_a_calibration_is_fitted_on(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    assert pipeline.bundle is not None
    fitted = Conditioning.for_build(lab.profile, pipeline.bundle.reference, compensates=True)
    measured = pipeline.process(brighter(lab)).frame
    np.testing.assert_array_equal(measured.pixels, fitted(brighter(lab)).pixels)


def test_hidden_pixels_are_those_of_the_reference(lab: VirtualLab) -> None:
    hidden = np.zeros(lab.image(None).shape[:2], np.bool_)
    hidden[:, :40] = True
    damaged = lab.image(None).copy()
    damaged[hidden] = 0
    seen = conditioning(lab).condition_without(shown(damaged, lab), hidden)
    assert np.abs(seen.pixels.astype(float) - lab.image(None)).max() <= 2


def test_a_reference_is_verified_against_the_trusted_one(lab: VirtualLab) -> None:
    times = (0.0, 0.1, 0.2)
    known = Reference(lab.image(None).astype(np.float32), NAMES)
    swapped = replace(known, pixels=known.pixels[..., [1, 0, 2]])
    frame = replace(shown(lab.image(None), lab), exposure_times_s=times)
    condition = Conditioning.for_build(lab.profile, swapped, compensates=False, known=known)
    with pytest.raises(SequenceError, match=r"the reference: .*shows light"):
        condition(frame)
    condition.with_reference(known)(frame)
