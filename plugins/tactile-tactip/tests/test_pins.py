"""Pins are found, and what is none is not, on virtual and on recorded frames."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial import KDTree

from tactile_core.acquisition.acquisition import average
from tactile_core.errors import InputError
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import DisplacementField, MarkerDetections, MarkerField
from tactile_tactip.dome import Plate, picture, pins_at_rest, pressed_pins, seen_px

Array = np.ndarray[Any, Any]

TACTIP = load_profile("tactip")
SAME_PX = 1.5  # [px] a third of a pin


def pipeline_of(image: Array) -> Pipeline:
    return Pipeline(TACTIP, None, average([Pipeline(TACTIP).frame(image)]))


def missed_and_spurious(found: Array, true: Array) -> tuple[int, int]:
    missed = KDTree(found).query(true)[0] > SAME_PX
    spurious = KDTree(true).query(found)[0] > SAME_PX
    return int(missed.sum()), int(spurious.sum())


def virtual_plates(count: int) -> Iterator[Plate]:
    rng = np.random.default_rng(0)
    for _ in range(count):
        shear = float(rng.uniform(-1.5, 1.5)), float(rng.uniform(-1.5, 1.5))
        yield Plate(float(rng.uniform(-0.5, 3.5)), float(rng.uniform(-25, 25)), shear)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_white_pins_in_uneven_light_are_found_to_a_tenth_of_a_pixel(seed: int) -> None:
    rest_px = seen_px(pins_at_rest(), TACTIP.image)
    pipeline = pipeline_of(picture(pins_at_rest(), TACTIP.image, number=0, seed=seed))
    for number, plate in enumerate(virtual_plates(20), 1):
        pins_mm = pressed_pins(plate)
        reading = pipeline.process(
            pipeline.frame(picture(pins_mm, TACTIP.image, number=number, seed=seed))
        )
        true_px = seen_px(pins_mm, TACTIP.image)
        assert missed_and_spurious(reading[MarkerDetections].centres_px, true_px) == (0, 0)
        pins = reading[MarkerField]
        order = KDTree(rest_px).query(pins.reference_px)[1]
        assert pins.seen.all()
        assert np.abs(pins.px - true_px[order]).max() < 0.3
        assert np.sqrt(np.square(pins.px - true_px[order]).mean()) < 0.1


def test_the_field_of_displacement_is_that_of_the_pins() -> None:
    pipeline = pipeline_of(picture(pins_at_rest(), TACTIP.image, number=0))
    pins_mm = pressed_pins(Plate(2.5, 10.0, (0.8, -0.4)))
    reading = pipeline.process(pipeline.frame(picture(pins_mm, TACTIP.image, number=1)))
    pins, field = reading[MarkerField], reading[DisplacementField]
    column, row = np.rint(pins.px).astype(int).T
    # a pixel's rounding, times how steeply the displacement changes
    assert np.abs(field.mm[row, column] - pins.displacement_mm).max() < 0.1
    assert pins.displacement_mm[:, 0].mean() > 0.1
    assert pins.displacement_mm[:, 1].mean() < -0.05
    assert field.valid[row, column].all()


def components(image: Array) -> Array:
    """The pins by another method: what is connected, small and within the rim."""
    _, _, stats, centres = cv2.connectedComponentsWithStats(image, connectivity=8)
    area = stats[1:, cv2.CC_STAT_AREA]
    away = np.hypot(*(centres[1:] - 127.5).T)
    return centres[1:][(area >= 4) & (area < 150) & (away < 112)]


@pytest.mark.recordings
def test_nearly_all_recorded_pins_are_found_and_hardly_anything_else(recordings: Path) -> None:
    files = sorted((recordings / "tactip" / "surface" / "frames").glob("*.png"))[::5]
    images = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in files]
    pipeline = pipeline_of(images[0])
    expected, missed, spurious, seen = 0, 0, 0, []
    for image in images:
        true_px = components(image)
        assert len(true_px) in (127, 128)  # as many as the sensor has, or a piece of the rim
        reading = pipeline.process(pipeline.frame(image))
        found = missed_and_spurious(reading[MarkerDetections].centres_px, true_px)
        expected, missed, spurious = expected + 127, missed + found[0], spurious + found[1]
        seen.append(reading[MarkerField].seen)
        assert set(reading.warnings) <= set(pipeline.notes)  # which come with the first frame
    assert missed <= 0.03 * expected
    assert spurious <= 0.01 * expected
    assert np.mean(seen) > 0.97


@pytest.mark.recordings
def test_recorded_pins_keep_their_identity_from_any_reference(recordings: Path) -> None:
    files = sorted((recordings / "tactip" / "surface" / "frames").glob("*.png"))
    images = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in files[::50]]
    ways = [pipeline_of(images[0]), pipeline_of(images[5])]
    places = []
    for pipeline in ways:
        pins = [pipeline.process(pipeline.frame(image))[MarkerField] for image in images]
        assert all(one.seen.all() for one in pins)
        places.append(np.stack([one.px for one in pins]))
    # the same tracks, whichever frame numbers them
    index = KDTree(places[1][0]).query(places[0][0])[1]
    assert places[1][:, index] == pytest.approx(places[0], abs=1e-3)


def test_a_reference_of_another_sensor_is_refused() -> None:
    few = pins_at_rest()[::2]
    pipeline = pipeline_of(picture(few, TACTIP.image, number=0))
    assert "the reference shows 64 bright markers, and the profile says 127" in pipeline.notes[0]
    with pytest.raises(InputError, match="shows 64 pins, and this sensor has 127"):
        pipeline.process(pipeline.frame(picture(few, TACTIP.image, number=1)))


def test_a_frame_of_another_sensor_is_pointed_out() -> None:
    pipeline = pipeline_of(picture(pins_at_rest(), TACTIP.image, number=0))
    few = picture(pins_at_rest()[::2], TACTIP.image, number=1)
    reading = pipeline.process(pipeline.frame(few))
    assert any("only 64 of 127 pins are found" in warning for warning in reading.warnings)


def test_pieces_of_the_rim_in_the_reference_are_no_pins() -> None:
    image = picture(pins_at_rest(), TACTIP.image, number=0)
    cv2.circle(image, (246, 100), 2, 200, -1)
    pipeline = pipeline_of(image)
    reading = pipeline.process(pipeline.frame(image))
    assert len(reading[MarkerDetections].centres_px) == 128
    pins = reading[MarkerField].reference_px
    assert len(pins) == 127
    assert np.hypot(*(pins - [246, 100]).T).min() > 10


def test_frames_are_independent_so_that_workers_may_share_them() -> None:
    pipeline = pipeline_of(picture(pins_at_rest(), TACTIP.image, number=0))
    assert not any(step.estimator.stateful for step in pipeline.steps)
    frames = [
        replace(pipeline.frame(picture(pressed_pins(plate), TACTIP.image, number=n)), sequence=n)
        for n, plate in enumerate(virtual_plates(3))
    ]
    forwards = [pipeline.process(frame)[MarkerField].px for frame in frames]
    backwards = [pipeline.process(frame)[MarkerField].px for frame in reversed(frames)]
    assert all((a == b).all() for a, b in zip(forwards, reversed(backwards), strict=True))
