"""Measuring frames with a profile and a bundle, and the checks of frames and readings."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from support.gains import MOST, WELL_INSIDE, gains
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core import (
    ContactMask,
    Estimator,
    Frame,
    Gradients,
    HeightMap,
    Pipeline,
    Reading,
    Reference,
)
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.images import write_png
from tactile_core.interfaces.estimator import External, SensorContext
from tactile_core.pipeline.chain import Chain
from tactile_core.pipeline.playback import read_frames
from tactile_core.quantities import Quantity, ShownGel

PRESS = BallPress((70.0, 62.0), BALL_MM, 0.8)


def frame_of(lab: VirtualLab, press: BallPress | None) -> Frame:
    pixels = lab.image(press)
    return Frame(pixels, ("red", "green", "blue"), lab.profile.image.mm_per_px, source="press")


def arrays_of(reading: Reading) -> dict[str, np.ndarray]:
    return {
        name: array
        for quantity in reading.quantities.values()
        for name, array in quantity.arrays().items()
    }


def test_a_frame_becomes_slopes_height_and_contact(lab: VirtualLab) -> None:
    reading = Pipeline(lab.profile, lab.bundle).process(frame_of(lab, PRESS))
    truth = PRESS.height_mm((120, 160), lab.profile.image.mm_per_px)
    assert reading[HeightMap].mm.max() == pytest.approx(truth.max(), rel=0.08)
    assert set(reading.steps) == {"height", "contact"}
    assert reading[Gradients].x.shape == (120, 160)


def test_the_reference_measured_like_a_press_is_at_zero(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    reading = pipeline.process(frame_of(lab, None))
    assert np.abs(reading[HeightMap].mm).max() < 0.01
    assert pipeline.reference is not None
    itself = pipeline.process(pipeline.reference.as_frame(lab.profile.image.mm_per_px))
    assert np.abs(itself[HeightMap].mm).max() < 1e-6
    assert itself[ContactMask].area_mm2 == 0
    assert set(itself.quantities) == {Gradients, HeightMap, ContactMask, ShownGel}


def test_slopes_of_unseen_presses_have_unit_gain(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    measured, expected = [], []
    for centre in ((70.0, 62.0), (50.0, 40.0), (105.0, 70.0)):
        press = replace(PRESS, centre_px=centre)
        found = pipeline.process(frame_of(lab, press))[Gradients]
        offset_mm = (np.stack(np.indices(found.x.shape)[::-1], -1) - centre) * found.mm_per_px
        square = (offset_mm**2).sum(-1)
        inside = square < (WELL_INSIDE * press.contact_radius_mm) ** 2
        slope = -offset_mm[inside] / np.sqrt((BALL_MM / 2) ** 2 - square[inside])[:, None]
        expected.append(slope)
        measured.append(np.stack([found.x, found.y], -1)[inside])
    assert gains(np.concatenate(measured), np.concatenate(expected)) == pytest.approx(1, abs=MOST)


def test_the_contact_area_is_about_that_of_the_true_circle(lab: VirtualLab) -> None:
    contact = Pipeline(lab.profile, lab.bundle).process(frame_of(lab, PRESS))[ContactMask]
    assert contact.area_mm2 == pytest.approx(np.pi * PRESS.contact_radius_mm**2, rel=0.35)


def test_an_undeformed_frame_has_no_contact(lab: VirtualLab) -> None:
    reading = Pipeline(lab.profile, lab.bundle).process(frame_of(lab, None))
    assert reading[ContactMask].area_mm2 == 0


def test_a_pipeline_pickles_and_measures_the_same(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    copy = pickle.loads(pickle.dumps(pipeline))
    frame = frame_of(lab, PRESS)
    np.testing.assert_array_equal(
        copy.process(frame)[HeightMap].mm, pipeline.process(frame)[HeightMap].mm
    )


def test_a_reading_is_not_changed_by_later_frames(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    reading = pipeline.process(frame_of(lab, PRESS))
    before = {name: array.copy() for name, array in arrays_of(reading).items()}
    for _ in range(3):
        pipeline.process(frame_of(lab, None))
    for name, array in arrays_of(reading).items():
        np.testing.assert_array_equal(array, before[name], err_msg=name)


def test_without_a_bundle_the_steps_that_need_slopes_are_left_out(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile)
    reading = pipeline.process(frame_of(lab, PRESS))
    assert HeightMap not in reading
    assert "height, contact" in pipeline.notes[0]


def test_a_missing_quantity_is_named(lab: VirtualLab) -> None:
    reading = Pipeline(lab.profile).process(frame_of(lab, PRESS))
    with pytest.raises(KeyError, match="no HeightMap"):
        reading[HeightMap]


def test_a_frame_of_another_size_is_rejected(lab: VirtualLab) -> None:
    frame = Frame(np.zeros((10, 10, 3), np.uint8), ("red", "green", "blue"), 0.1)
    with pytest.raises(InputError, match="10 × 10"):
        Pipeline(lab.profile, lab.bundle).process(frame)


@pytest.mark.parametrize("shape", [(), (5,), (120, 160), (120, 160, 3, 1)])
def test_a_frame_without_a_channel_axis_is_rejected(
    lab: VirtualLab, shape: tuple[int, ...]
) -> None:
    frame = Frame(np.zeros(shape, np.uint8), ("red", "green", "blue"), 0.1245)
    with pytest.raises(InputError, match=r"\(H, W, K\)"):
        Pipeline(lab.profile, lab.bundle).process(frame)


@pytest.mark.parametrize("dtype", ["int64", "complex64", "bool", "float16", "U3"])
def test_a_frame_of_another_dtype_is_rejected(lab: VirtualLab, dtype: str) -> None:
    frame = Frame(np.zeros((120, 160, 3), dtype), ("red", "green", "blue"), 0.1245)
    with pytest.raises(InputError, match="uint8, uint16 or float32"):
        Pipeline(lab.profile, lab.bundle).process(frame)


def test_a_frame_of_other_channels_is_rejected(lab: VirtualLab) -> None:
    frame = Frame(np.zeros((120, 160, 1), np.uint8), ("grey",), 0.1245)
    with pytest.raises(InputError, match="1 channels"):
        Pipeline(lab.profile, lab.bundle).process(frame)


def test_only_what_the_reference_shows_bright_can_be_too_dark(lab: VirtualLab) -> None:
    image, reference = (lab.image(None, seed=seed) for seed in range(2))
    for each in (image, reference):
        each[:, :16] = 0
    pipeline = Pipeline(lab.profile, lab.bundle)
    (said,) = pipeline.process(pipeline.frame(image)).warnings
    assert said.startswith("10% of the frame is too dark")
    pipeline = pipeline.with_reference(Reference(reference.astype(np.float32), pipeline.channels))
    assert not pipeline.process(pipeline.frame(image)).warnings
    (said,) = pipeline.process(pipeline.frame(np.zeros_like(image))).warnings[:1]
    assert said.startswith("100% of the frame is too dark")


def test_a_thresholded_image_has_no_exposure_to_warn_of(lab: VirtualLab) -> None:
    image = lab.image(None)
    black_or_white = np.where(image > image.mean(), 255, 0).astype(np.uint8)
    pipeline = Pipeline(lab.profile, lab.bundle)
    pipeline.process(pipeline.frame(image))
    said = pipeline.process(pipeline.frame(black_or_white)).warnings
    assert not any("too dark" in one or "saturated" in one for one in said)
    black_or_white[0, 0] = 128
    said = pipeline.process(pipeline.frame(black_or_white)).warnings
    assert any("saturated; shorten the exposure" in one for one in said)


def test_a_wholly_dark_reference_excuses_no_dark_frame(lab: VirtualLab) -> None:
    dark = np.zeros_like(lab.image(None))
    reference = Reference(dark.astype(np.float32), ("red", "green", "blue"))
    pipeline = Pipeline(lab.profile, lab.bundle, reference)
    warnings = pipeline.process(pipeline.frame(dark)).warnings
    assert any("too dark; lengthen the exposure" in one for one in warnings)


def test_arrays_of_a_reading_are_read_only(lab: VirtualLab) -> None:
    height = Pipeline(lab.profile, lab.bundle).process(frame_of(lab, PRESS))[HeightMap]
    with pytest.raises(ValueError, match="read-only"):
        height.mm[0, 0] = 1.0


def test_earlier_readings_keep_their_values(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    first = pipeline.process(frame_of(lab, PRESS))
    before = first[HeightMap].mm.copy(), first[Gradients].x.copy()
    pipeline.process(frame_of(lab, None))
    np.testing.assert_array_equal(first[HeightMap].mm, before[0])
    np.testing.assert_array_equal(first[Gradients].x, before[1])


def test_a_new_reference_keeps_the_serial_check(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle, serial="0007")
    undeformed = Reference(lab.image(None).astype(np.float32), ("red", "green", "blue"))
    assert pipeline.bundle is not None
    foreign = pipeline.bundle.manifest.model_copy(update={"serial": "0008"})
    pipeline.bundle = replace(pipeline.bundle, manifest=foreign)
    with pytest.raises(CalibrationError, match="0008"):
        pipeline.with_reference(undeformed)


def test_notes_are_warnings_of_the_first_reading_only(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile)
    frame = replace(frame_of(lab, None), sequence=7)
    assert set(pipeline.notes) <= set(pipeline.process(frame).warnings)
    assert pipeline.process(frame).warnings == ()


def test_a_reading_is_indexed_by_type_and_by_step(lab: VirtualLab) -> None:
    reading = Pipeline(lab.profile, lab.bundle).process(frame_of(lab, PRESS))
    assert reading["height"] is reading[HeightMap]
    assert "height" in reading
    assert "slip" not in reading
    with pytest.raises(KeyError, match=r"no step 'slip', only contact, height"):
        reading["slip"]


def test_a_frame_made_from_pixels_equals_the_recorded_one(lab: VirtualLab, tmp_path: Path) -> None:
    image = lab.profile.image.model_copy(update={"flip": "horizontal", "crop": (4, 2, 120, 90)})
    profile = lab.profile.model_copy(update={"image": image})
    pixels = lab.image(PRESS)
    write_png(tmp_path / "press.png", pixels)
    (recorded,) = read_frames(profile, tmp_path / "press.png")
    made = Pipeline(profile).frame(pixels, source="press")
    np.testing.assert_array_equal(made.pixels, recorded.pixels)
    assert (made.channels, made.source) == (recorded.channels, "press")


def test_a_frame_needs_one_image_per_exposure(lab: VirtualLab) -> None:
    dark = np.zeros((512, 612), np.uint8)
    pipeline = pickle.loads(pickle.dumps(Pipeline("desktop_six_led")))
    assert pipeline.frame(*[dark] * 6).pixels.shape[2] == 6
    with pytest.raises(InputError, match="takes 6 exposures, not 2"):
        pipeline.frame(dark, dark)


@dataclass(frozen=True, eq=False)
class RobotPose(Quantity):
    z_mm: float


@dataclass(frozen=True, eq=False)
class HighestPoint(Quantity):
    z_mm: float


class InRobotFrame(Estimator):
    def estimate(self, height: HeightMap, pose: External[RobotPose]) -> HighestPoint:
        return HighestPoint(pose.z_mm + float(height.mm.max()))


def test_external_quantities_are_given_with_the_frame(lab: VirtualLab) -> None:
    pipeline = Pipeline(lab.profile, lab.bundle)
    image, gel = lab.profile.image, lab.profile.gel
    steps = {step.name: step.estimator for step in pipeline.steps}
    estimator = InRobotFrame(InRobotFrame.Options(), SensorContext(image, gel))
    pipeline._chain = Chain({**steps, "robot": estimator})
    frame = frame_of(lab, PRESS)
    reading = pipeline.process(frame, RobotPose(100.0))
    assert reading[HighestPoint].z_mm == 100 + reading[HeightMap].mm.max()
    assert RobotPose not in reading
    without = pipeline.process(frame)
    assert "robot" not in without
    assert any("'robot' needs RobotPose" in warning for warning in without.warnings)


def test_a_printed_reading_names_its_quantities_and_warnings_and_no_array(lab: VirtualLab) -> None:
    reading = Pipeline(lab.profile, lab.bundle).process(frame_of(lab, PRESS))
    shown = str(replace(reading, warnings=("clean the gel",))).splitlines()
    assert shown[0] == "Reading of press at 0.000 s"
    assert any("HeightMap(mm=<" in line for line in shown)
    assert shown[-1] == "  warning: clean the gel"
    assert max(map(len, shown)) < 600
