"""``core.slip`` and its cues: what each kind of evidence proves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tactile_core.algorithms.slip.state import FUSION
from tactile_core.builtin.imprint_motion import MotionOfImprint
from tactile_core.builtin.slip import Slip
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import (
    ContactLoss,
    ContactShear,
    Frame,
    ImprintMotion,
    MarkerField,
    Reference,
    SlipContact,
    SlipState,
)
from tactile_sim import VirtualStage

SHAPE = 48, 64
CONTEXT = SensorContext(load_profile("hex_fingertip").image, load_profile("hex_fingertip").gel)
HELD = ContactShear(True, 0.95, entropy_bits=1.0, rotation_deg=0.0)
WARNS = replace(HELD, stick_share=0.4)
SLID = ImprintMotion(True, 0.5, 0.2, 0.8, 0.1)
STILL = ImprintMotion(True, 0.0, 0.1, 0.01, 0.005)
BLIND = ContactShear(False), ImprintMotion(False)


def contact(source: str, *, absolute: bool, touched: bool = True) -> SlipContact:
    return SlipContact(np.full(SHAPE, touched), 1.0, 0.0, source, absolute)  # type: ignore[arg-type]


UNKNOWN_LOAD = contact("motion", absolute=False)
KNOWN = contact("height", absolute=True)


def state(
    where: SlipContact,
    shear: ContactShear | None,
    imprint: ImprintMotion | None,
    loss: ContactLoss | None = None,
) -> SlipState:
    return Slip(Slip.Options(), CONTEXT).estimate(where, shear, imprint, loss)


def test_an_imprint_that_slid_proves_slip_where_the_load_is_unknown() -> None:
    assert state(UNKNOWN_LOAD, HELD, SLID).state == "slip"
    assert state(UNKNOWN_LOAD, HELD, SLID).degree > 0.5
    assert state(UNKNOWN_LOAD, HELD, STILL).state == "stick"


def test_shear_alone_only_warns_where_the_load_is_unknown() -> None:
    assert state(UNKNOWN_LOAD, replace(HELD, stick_share=0.0), STILL).state == "incipient"


def test_a_known_contact_slips_when_shear_and_imprint_agree() -> None:
    assert state(KNOWN, HELD, SLID).state == "stick"
    assert state(KNOWN, WARNS, STILL).state == "incipient"
    assert state(KNOWN, WARNS, SLID).state == "incipient", "only the light may have changed"
    assert state(KNOWN, WARNS, replace(SLID, moved=1.5)).state == "slip"


def test_where_the_loss_of_contact_is_measured_only_it_proves_slip() -> None:
    held, lost = ContactLoss(True, 4.0, 5.0, 0.3), ContactLoss(True, 1.0, 5.0, 0.8)
    assert state(UNKNOWN_LOAD, HELD, STILL, loss=held).state == "stick"
    assert state(UNKNOWN_LOAD, HELD, SLID, loss=held).state == "incipient"
    assert state(UNKNOWN_LOAD, HELD, STILL, loss=lost).state == "slip"
    assert state(UNKNOWN_LOAD, HELD, STILL, loss=lost).degree == 0.8


def test_a_contact_that_never_settled_is_unknown() -> None:
    weak = ContactLoss(True, 0.3, 0.4, 0.7)
    assert state(UNKNOWN_LOAD, HELD, SLID, loss=weak).state == "unknown"


def test_the_loss_of_contact_does_not_count_where_the_load_is_known() -> None:
    lost = ContactLoss(True, 0.0, 5.0, 1.0)
    assert state(KNOWN, HELD, STILL, loss=lost).state == "stick"
    assert state(UNKNOWN_LOAD, HELD, STILL, loss=ContactLoss(False)).state == "stick"


def test_a_change_of_the_imprint_counts_from_its_limit_on() -> None:
    for share, found in ((0.9, "stick"), (1.1, "slip")):
        change = replace(STILL, changed=share * FUSION.imprint_changed)
        assert state(UNKNOWN_LOAD, HELD, change).state == found


@pytest.mark.parametrize("shear", [None, BLIND[0]])
@pytest.mark.parametrize("imprint", [None, BLIND[1]])
def test_without_markers_and_flow_the_state_is_unknown(
    shear: ContactShear | None, imprint: ImprintMotion | None
) -> None:
    for where in (UNKNOWN_LOAD, KNOWN, contact("motion", absolute=False, touched=False)):
        found = state(where, shear, imprint)
        assert (found.state, found.degree, found.distance_mm) == ("unknown", 0.0, None)


def test_a_height_map_without_contact_shows_that_nothing_slips() -> None:
    nothing = contact("height", absolute=True, touched=False)
    assert state(nothing, *BLIND).state == "none"
    assert state(nothing, HELD, SLID).state == "none"


def test_each_cue_works_alone() -> None:
    assert state(UNKNOWN_LOAD, None, SLID).state == "slip"
    assert state(UNKNOWN_LOAD, WARNS, None).state == "incipient"


def test_the_kind_is_that_of_the_shear_unless_the_imprint_slid_measurably() -> None:
    turns = replace(WARNS, motion_mm=0.3, rotation_mm=0.3)
    assert state(KNOWN, turns, SLID).kind == "rotation"
    assert state(KNOWN, turns, replace(SLID, moved=1.5)).kind == "translation"
    assert state(UNKNOWN_LOAD, None, replace(SLID, kind="rotation")).kind == "rotation"


def test_the_distance_is_that_of_the_imprint() -> None:
    found = state(UNKNOWN_LOAD, HELD, SLID)
    assert (found.distance_mm, found.distance_std_mm) == (0.8, 0.1)
    assert found.summary()["slip"]["distance_mm"] == 0.8


def markers(shift_px: float, seen: int = 20, time_s: float = 0.0) -> MarkerField:
    at = np.random.default_rng(1).uniform(50, 400, (20, 2)).astype(np.float32)
    shown = np.arange(20) < seen
    moved = at + np.float32([shift_px, 0])
    return MarkerField(np.arange(20, dtype=np.int32), at, moved, shown, 0.05, time_s)


def test_an_imprint_is_not_tracked_without_markers_that_are_seen() -> None:
    pixels = np.full((480, 640, 3), 120, np.uint8)
    frame = Frame(pixels, ("red", "green", "blue"), 0.0276)
    reference = Reference(pixels.astype(np.float32), ("red", "green", "blue"))
    step = MotionOfImprint(Options(), CONTEXT)
    found = step.estimate(frame, reference, markers(0.0, seen=2), None, None)
    assert not found.tracked


def test_frames_without_a_visible_marker_give_an_unknown_state() -> None:
    shown = VirtualStage("hex_fingertip").frame()
    undeformed = Reference(shown.pixels.astype(np.float32), shown.channels)
    pipeline = Pipeline("hex_fingertip", None, undeformed)
    pipeline.process(shown)
    hidden = np.full_like(shown.pixels, 120)
    hidden[200:260, 300:360] = 180
    for number in range(3):
        state = pipeline.process(replace(shown, pixels=hidden, timestamp_s=number / 30))[SlipState]
        assert (state.state, state.degree) == ("unknown", 0.0)


def test_unrelated_images_and_markers_that_moved_too_far_show_no_slip() -> None:
    alone = Frame(np.zeros((*SHAPE, 3), np.uint8), ("red", "green", "blue"), 0.1, standalone=True)
    ids, places = np.arange(4, dtype=np.int32), np.zeros((4, 2), np.float32)
    outrun = MarkerField(ids, places, places, np.ones(4, np.bool_), 0.1, outrun=True)
    slip = Slip(Slip.Options(), CONTEXT)
    for seen in ({"frame": alone}, {"markers": outrun}):
        found = slip.estimate(KNOWN, WARNS, SLID, None, **seen)  # type: ignore[arg-type]
        assert found.state == "unknown"
        assert found.reason
    released = contact("height", absolute=True, touched=False)
    assert slip.estimate(released, HELD, STILL, None, frame=alone).state == "none"
    assert slip.estimate(KNOWN, HELD, STILL, None).reason == ""
    assert any("higher frame rate" in words for words in outrun.warnings())
