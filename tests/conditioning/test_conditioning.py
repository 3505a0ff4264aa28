"""A frame is conditioned once, and everybody is given the same frame."""

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
    return Conditioning.of(lab.profile, reference, compensates=compensates)


def brighter(lab: VirtualLab) -> Frame:
    pixels = np.rint(lab.image(None) * np.array([1.04, 1.0, 0.97]))
    return shown(np.clip(pixels, 0, 255).astype(np.uint8), lab)


def test_light_that_changed_is_brought_back_to_the_level_of_the_reference(lab: VirtualLab) -> None:
    apart = conditioning(lab)(brighter(lab)).pixels.astype(float) - lab.image(None)
    assert np.abs(apart.mean(axis=(0, 1))).max() < 0.5


def test_a_model_that_compensates_by_itself_is_given_the_pixels_as_they_are(
    lab: VirtualLab,
) -> None:
    frame = brighter(lab)
    assert conditioning(lab, compensates=False)(frame).pixels is frame.pixels


def test_without_a_reference_the_light_stays(lab: VirtualLab) -> None:
    frame = brighter(lab)
    assert Conditioning.of(lab.profile, None, compensates=True)(frame).pixels is frame.pixels


def test_a_pipeline_measures_the_frame_that_a_calibration_is_fitted_on(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    assert pipeline.bundle is not None
    fitted = Conditioning.of(lab.profile, pipeline.bundle.reference, compensates=True)
    measured = pipeline.process(brighter(lab)).frame
    np.testing.assert_array_equal(measured.pixels, fitted(brighter(lab)).pixels)


def test_where_a_frame_is_hidden_the_reference_shows(lab: VirtualLab) -> None:
    hidden = np.zeros(lab.image(None).shape[:2], np.bool_)
    hidden[:, :40] = True
    spoilt = lab.image(None).copy()
    spoilt[hidden] = 0
    seen = conditioning(lab).without(shown(spoilt, lab), hidden)
    assert np.abs(seen.pixels.astype(float) - lab.image(None)).max() <= 2


def test_a_sequence_is_verified_by_the_reference_that_is_known(lab: VirtualLab) -> None:
    times = (0.0, 0.1, 0.2)
    known = Reference(lab.image(None).astype(np.float32), NAMES)
    swapped = replace(known, pixels=known.pixels[..., [1, 0, 2]])
    frame = replace(shown(lab.image(None), lab), exposure_times_s=times)
    condition = Conditioning.of(lab.profile, swapped, compensates=False, known=known)
    with pytest.raises(SequenceError, match=r"the reference: .*shows light"):
        condition(frame)
    condition.against(known)(frame)
