"""``core.slip`` on virtual gels with marker noise: detection, and no false alarms."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from experiments.slip_sequences import (
    GROSS,
    HALF,
    Judged,
    Plan,
    SlipSteps,
    SlipWatch,
    judged,
    looks,
    small_profile,
)
from tactile_core.builtin.slip import Slip
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    MarkerField,
    Reference,
    SlipState,
)
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.stage import VirtualStage

DISC = Plan(
    "disc",
    "flat",
    {"diameter_mm": 9.0},
    friction=0.4,
    depth_mm=0.15,
    press_frames=2,
    place_mm=(0.4, -0.3),
    angle_deg=0.0,
    turned=False,
    step=0.03,
    direction_rad=0.7,
    speed_mm_s=None,
    seed=5,
)
PLANS = {
    "disc": DISC,
    "sphere": replace(
        DISC,
        kind="sphere",
        shape="sphere",
        options={"diameter_mm": 18.0},
        depth_mm=0.45,
        speed_mm_s=0.1,
        seed=6,
    ),
    "turned disc": replace(DISC, turned=True, step=-0.5, seed=7),
}


@pytest.fixture(scope="module")
def runs() -> dict[str, Judged]:
    return {name: judged(plan) for name, plan in PLANS.items()}


@pytest.mark.parametrize("name", list(PLANS))
def test_it_warns_of_partial_slip_before_gross_slip(runs: dict[str, Judged], name: str) -> None:
    run = runs[name]
    first = int(np.argmax(run.alarm))
    assert run.alarm.any()
    assert run.stick_share[first] < 0.8
    assert run.stick_share[first] > GROSS


@pytest.mark.parametrize("name", list(PLANS))
def test_the_degree_ranks_most_frames_correctly(runs: dict[str, Judged], name: str) -> None:
    run = runs[name]
    held, slipping = run.degree[run.stick_share >= HALF], run.degree[run.stick_share < HALF]
    assert (slipping[:, None] > held).mean() > 0.96


@pytest.mark.parametrize("name", list(PLANS))
def test_an_alarm_is_not_toggled(runs: dict[str, Judged], name: str) -> None:
    assert np.abs(np.diff(runs[name].alarm.astype(int))).sum() <= 1


@pytest.mark.parametrize("name", ["disc", "sphere"])
def test_gross_slip_is_reported_after_the_entropy_warns(runs: dict[str, Judged], name: str) -> None:
    run = runs[name]
    gross = np.flatnonzero(run.stick_share < GROSS)
    assert all(run.states[i].state == "slip" for i in gross[4:])
    assert {run.states[i].kind for i in gross[4:]} == {"translation"}
    assert (run.states[gross[0] - 1].entropy_bits or 0) > 4


def test_a_rotation_is_reported_with_its_sign(runs: dict[str, Judged]) -> None:
    run = runs["turned disc"]
    slipping = [state for state in run.states if state.state != "stick"]
    assert {state.kind for state in slipping} == {"rotation"}
    assert run.states[5].rotation_deg == pytest.approx(6 * -0.5, rel=0.1)


def _stepped() -> tuple[GelSurface, SlipWatch, SlipSteps]:
    profile = small_profile(DISC)
    surface, watch = GelSurface(profile, "fast"), SlipWatch(profile, 3)
    surface.indent_with(make_indenter("flat", diameter_mm=9.0))
    return surface, watch, SlipSteps(watch.context)


def _state(slip: SlipSteps, watch: SlipWatch, surface: GelSurface) -> SlipState:
    look = watch.look(surface, 0.0, moving=True)
    return slip.state(look.displacement, look.height, look.contact)


def test_a_press_and_a_hold_under_shear_raise_no_alarm() -> None:
    surface, watch, slip = _stepped()
    states = [_state(slip, watch, surface)]
    for depth in (0.04, 0.08, 0.12, 0.16):
        surface.press(depth_mm=depth)
        states.append(_state(slip, watch, surface))
    for _ in range(4):
        surface.shear(0.025, 0.0)
        states.append(_state(slip, watch, surface))
    for _ in range(20):
        states.append(_state(slip, watch, surface))
    assert [state.state for state in states] == ["none"] + ["stick"] * 28


def test_frames_with_an_empty_contact_mask_change_no_state() -> None:
    surface, watch, slip = _stepped()
    always = SlipSteps(watch.context)
    surface.press(depth_mm=0.1)
    for number in range(10):
        surface.shear(0.05, 0.0)
        look = watch.look(surface, 0.0, moving=True)
        shown = always.state(look.displacement, look.height, look.contact)
        mask = look.contact.mask & (number < 2)
        missed = ContactMask(mask, look.contact.mm_per_px)
        state = slip.state(look.displacement, look.height, missed)
        assert state.state == shown.state
    assert state.state == "slip"


def test_a_constant_height_error_changes_no_state() -> None:
    surface, watch, slip = _stepped()
    always = SlipSteps(watch.context)
    surface.press(depth_mm=0.15)
    states = []
    for _ in range(14):
        surface.shear(0.05, 0.0)
        look = watch.look(surface, 0.0, moving=True)
        shown = always.state(look.displacement, look.height, look.contact)
        sunk = replace(look.height, mm=look.height.mm - np.float32(0.15))
        nothing = replace(look.contact, mask=np.zeros_like(look.contact.mask))
        states.append(slip.state(look.displacement, sunk, nothing).state)
        assert states[-1] == shown.state
    assert {"stick", "slip"} <= set(states)


def test_an_object_that_stops_while_it_sticks_raises_no_alarm() -> None:
    surface, watch, slip = _stepped()
    surface.press(depth_mm=0.15)
    while True:
        surface.shear(0.025, 0.0)
        states = [_state(slip, watch, surface)]
        if surface.truth().stick.sum() < 0.7 * surface.truth().contact.sum():
            break
    states += [_state(slip, watch, surface) for _ in range(20)]
    assert {state.state for state in states} == {"stick"}


def test_release_resets_the_state() -> None:
    surface, watch, slip = _stepped()
    surface.press(depth_mm=0.1)
    for _ in range(12):
        surface.shear(0.05, 0.0)
        state = _state(slip, watch, surface)
    assert state.state == "slip"
    surface.release()
    state = _state(slip, watch, surface)
    assert (state.state, state.degree, state.onset_s) == ("none", 0.0, None)


def test_a_used_step_can_be_pickled() -> None:
    surface, watch, slip = _stepped()
    surface.press(depth_mm=0.1)
    for _ in range(3):
        surface.shear(0.05, 0.0)
        _state(slip, watch, surface)
    look = watch.look(surface, 0.0, moving=True)
    given = look.displacement, look.height, look.contact
    copy = pickle.loads(pickle.dumps(slip))
    assert vars(copy.state(*given)) == vars(slip.state(*given))


def test_after_reset_the_same_frames_give_the_same_states() -> None:
    plan = replace(DISC, most_steps=8, step=0.06)
    slip = SlipSteps(SlipWatch(small_profile(plan), 0).context)
    seen = list(looks(plan))

    def run() -> list[SlipState]:
        slip.reset()
        return [slip.state(s.displacement, s.height, s.contact) for s in seen]

    first = run()
    assert [vars(state) for state in run()] == [vars(state) for state in first]


def test_without_a_contact_mask_the_sheared_gel_is_the_contact() -> None:
    run = judged(DISC, with_height=False)
    held, slipping = run.degree[run.stick_share >= 0.9], run.degree[run.stick_share < GROSS]
    assert np.median(slipping) > np.median(held) + 0.3


def test_undeformed_gel_has_no_contact() -> None:
    profile = small_profile(DISC)
    context = SensorContext(profile.image, profile.gel)
    shape = profile.image.height_px, profile.image.width_px
    still = DisplacementField(
        np.zeros((*shape, 2), np.float32), np.ones(shape, np.bool_), profile.image.mm_per_px
    )
    nothing = ContactMask(np.zeros(shape, np.bool_), profile.image.mm_per_px)
    for given in ((still,), (still, nothing)):
        state = SlipSteps(context).state(*given)
        assert (state.state, state.entropy_bits) == ("none", None)


def test_a_new_contact_starts_from_zero() -> None:
    surface, watch, slip = _stepped()
    surface.press(depth_mm=0.15)
    for _ in range(4):
        _state(slip, watch, surface)
        surface.twist(-0.5)
    assert _state(slip, watch, surface).rotation_deg == pytest.approx(-2.0, rel=0.1)
    surface.release()
    _state(slip, watch, surface)
    surface.press(depth_mm=0.15)
    again = _state(slip, watch, surface)
    assert (again.state, again.entropy_bits) == ("stick", 0.0)
    assert again.rotation_deg == pytest.approx(0.0, abs=0.1)


def test_a_tare_sets_rotation_and_entropy_to_zero() -> None:
    surface, watch, slip = _stepped()
    surface.press(depth_mm=0.15)
    _state(slip, watch, surface)
    for _ in range(4):
        before = _state(slip, watch, surface)
        surface.twist(-0.5)
    look = watch.look(surface, 0.0, moving=True)
    tared = slip.state(look.displacement, look.height, look.contact, tare=True)
    surface.twist(0.5)
    after = _state(slip, watch, surface)
    assert before.rotation_deg == pytest.approx(-1.5, rel=0.1)
    assert tared.rotation_deg == pytest.approx(0.0, abs=0.1)
    assert (tared.state, tared.entropy_bits) == ("stick", 0.0)
    assert after.rotation_deg == pytest.approx(0.5, rel=0.2)


def test_the_imprint_does_not_depend_on_the_tare_of_the_markers() -> None:
    stage = VirtualStage("hex_fingertip", overrides={"gel": {"friction": 0.3}})
    first = stage.frame()
    undeformed = Reference(first.pixels.astype(np.float32), first.channels)
    pipeline = Pipeline("hex_fingertip", None, undeformed)
    stage.indenter("sphere", diameter_mm=10.0)
    stage.press(depth_mm=0.6)
    stage.shear(0.3, 0.1)
    context = SensorContext(pipeline.profile.image, pipeline.profile.gel)
    plain, tared = SlipSteps(context), SlipSteps(context)
    loaded_px, reference = None, pipeline.reference
    for _ in range(3):
        frame = stage.frame()
        reading = pipeline.process(frame)
        field, markers = reading[DisplacementField], reading[MarkerField]
        loaded_px = markers.px if loaded_px is None else loaded_px
        since = replace(markers, reference_px=loaded_px)
        state = plain.state(field, frame, reference, markers)
        assert vars(tared.state(field, frame, reference, since)) == vars(state)
        stage.shear(0.2, 0.0)
    assert np.abs(loaded_px - markers.reference_px).max() > 5
    assert state.degree > 0.2


def test_thresholds_out_of_order_are_refused() -> None:
    profile = small_profile(DISC)
    with pytest.raises(InputError, match="ordered"):
        Slip(Slip.Options(incipient=0.95), SensorContext(profile.image, profile.gel))
