"""The benchmark times every processing stage of a frame, for any profile."""

import json

import numpy as np
import pytest
from support.command_line import tactile
from support.virtual_lab import VirtualLab

from tactile_core.calibration.virtual_unit import VirtualUnit, virtual_unit
from tactile_core.errors import InputError
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    Gradients,
    HeightMap,
    MarkerField,
    Reference,
    ReferenceGradients,
    SlipState,
)
from tactile_sim.timing import Benches, bench
from tactile_sim.timing.unit import (
    ACQUIRE,
    CHECK,
    LIGHTS,
    MARKERS,
    SLOPES,
    WHOLE,
    Stream,
)

SMALL = (160, 120)


def marked() -> Profile:
    return load_profile("hex_fingertip", overrides={"calibration": {"use": "core.polynomial"}})


@pytest.fixture(scope="module")
def unit() -> VirtualUnit:
    return virtual_unit(marked(), size_px=SMALL)


@pytest.fixture(scope="module")
def result(lab: VirtualLab) -> Benches:
    return bench([marked(), lab.profile], sizes_px=[SMALL], seconds=0.05)


def test_another_size_shows_the_same_field_of_view(unit: VirtualUnit) -> None:
    plain, image = marked().image, unit.profile.image
    assert (image.width_px, image.height_px) == SMALL
    assert image.width_px * image.mm_per_px == pytest.approx(plain.width_px * plain.mm_per_px)
    assert unit.frames[0].pixels.shape == (120, 160, 3)


def test_a_virtual_unit_measures_its_own_presses(unit: VirtualUnit) -> None:
    reading = Pipeline(unit.profile, unit.bundle).process(unit.frames[0])
    depth_mm = 0.2 * 0.22 * SMALL[0] * unit.profile.image.mm_per_px
    assert reading[HeightMap].mm.max() > 0.7 * depth_mm


def test_the_stages_together_measure_what_the_pipeline_measures(unit: VirtualUnit) -> None:
    stream, frame = Stream(unit), unit.frames[1]
    staged = stream.process_stages(frame, {})
    whole = Pipeline(unit.profile, unit.bundle).process(frame)
    given = {Frame, Reference, ReferenceGradients}
    assert set(staged) - given == set(whole.quantities)
    for kind in (Gradients, HeightMap):
        for name, array in whole[kind].arrays().items():
            assert np.array_equal(staged[kind].arrays()[name], array)


def test_every_stage_of_a_marked_gel_is_named(unit: VirtualUnit) -> None:
    steps = ["height", "contact", "markers", "tracking", "displacement"]
    steps += ["slip_contact", "shear", "imprint", "loss", "slip"]
    assert list(Stream(unit).time_stages()) == [ACQUIRE, MARKERS, SLOPES, CHECK, *steps]


def test_a_tracked_contact_under_shear_is_timed() -> None:
    unit = virtual_unit(marked(), size_px=(320, 240))
    stream = Stream(unit)
    for frame in unit.stroke:
        measured = stream.process_stages(frame, {})
        field, markers, contact, slip = (
            measured[kind] for kind in (DisplacementField, MarkerField, ContactMask, SlipState)
        )
        assert isinstance(contact, ContactMask)
        assert isinstance(field, DisplacementField)
        assert isinstance(markers, MarkerField)
        assert isinstance(slip, SlipState)
        assert contact.mask.any()
        assert markers.seen.sum() > 100
        assert markers.seen.mean() > 0.9
        assert field.mm[contact.mask][:, 0].mean() > 0.5 * unit.profile.image.mm_per_px
        assert slip.state != "none"
        assert slip.entropy_bits is not None


def test_sequential_lights_are_verified() -> None:
    profile = load_profile("desktop_six_led")
    stream = Stream(virtual_unit(profile, size_px=(204, 171)))
    assert list(stream.time_stages()) == [ACQUIRE, LIGHTS, SLOPES, CHECK, "height", "contact"]
    assert list(stream.whole()) == [WHOLE]


def test_each_profile_is_measured_and_the_whole_comes_last(result: Benches) -> None:
    assert [one.profile for one in result.benches] == ["hex_fingertip", "virtual_lab"]
    for one in result.benches:
        assert one.stages[-1].stage == WHOLE
        assert one.rounds >= 10
        assert all(0 < cost.median_ms <= cost.p90_ms for cost in one.stages)


def test_profiles_that_cannot_be_rendered_are_left_out_and_the_calibration_may_be_chosen(
    lab: VirtualLab,
) -> None:
    deep = lab.profile.image.model_copy(update={"bit_depth": 12})
    sensor = lab.profile.optics.sensor.model_copy(update={"jpeg_quality": 90})
    optics = lab.profile.optics.model_copy(update={"sensor": sensor})
    broken = lab.profile.model_copy(update={"name": "broken", "image": deep, "optics": optics})
    with pytest.raises(InputError, match="JPEG holds 8 bits"):
        virtual_unit(broken)
    both = bench([broken, lab.profile], calibration="core.lookup_table", seconds=0.01)
    assert [one.profile for one in both.benches] == ["virtual_lab"]
    assert both.left_out[0].startswith("broken: ")
    assert both.benches[0].model == "core.lookup_table"


def test_the_machine_is_named(result: Benches) -> None:
    summary = json.loads(json.dumps(result.summary()))
    assert summary["machine"]["cpu"]
    assert {"python", "numpy", "tactile-core"} <= set(summary["machine"]["versions"])
    assert {"stage", "median_ms", "p90_ms", "fps"} == set(summary["benches"][0]["stages"][0])


def test_a_size_must_be_two_sensible_numbers(lab: VirtualLab) -> None:
    for size in ("640", "8x8"):
        done = tactile("bench", lab.profile_path, "--size", size)
        assert done.returncode == 2
        assert "640x480" in done.stderr
        assert done.stdout == ""


def test_an_unknown_profile_suggests_the_nearest() -> None:
    done = tactile("bench", "hex_fingertp")
    assert done.returncode == 2
    assert "hex_fingertip" in done.stderr
