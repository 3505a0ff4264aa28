"""The state machine of slip: hysteresis, onset and reset."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.slip.state import SlipMachine, Thresholds
from tactile_core.errors import InputError

LIMITS = Thresholds(incipient=0.4, incipient_ends=0.3, slip=0.75, slip_ends=0.6)

degrees = st.floats(0, 1)
sequences = st.lists(st.none() | degrees, max_size=40)


def _run(sequence: list[float | None]) -> SlipMachine:
    machine = SlipMachine(LIMITS)
    for number, degree in enumerate(sequence):
        machine.update(degree, "translation", float(number))
    return machine


@given(sequences, degrees)
def test_a_constant_degree_changes_the_state_at_most_once(
    before: list[float | None], degree: float
) -> None:
    machine = _run([*before, degree])
    first = machine.name, machine.kind, machine.onset_s
    for time_s in range(100, 105):
        machine.update(degree, "rotation", float(time_s))
    assert (machine.name, machine.kind, machine.onset_s) == first


@given(sequences, st.lists(st.floats(0.31, 0.59), min_size=1, max_size=30))
def test_noise_within_the_hysteresis_does_not_toggle_the_state(
    before: list[float | None], noise: list[float]
) -> None:
    machine = _run(before)
    names = []
    for degree in noise:
        machine.update(degree, "translation", 99.0)
        names.append(machine.name)
    changes = sum(a != b for a, b in itertools.pairwise(names))
    assert changes <= 1


@given(sequences)
def test_only_slip_has_a_kind_and_an_onset(
    sequence: list[float | None],
) -> None:
    machine = _run(sequence)
    slips = machine.name in ("incipient", "slip")
    assert (machine.kind is not None) == slips == (machine.onset_s is not None)


@given(sequences)
def test_the_end_of_contact_resets_the_machine(sequence: list[float | None]) -> None:
    assert _run([*sequence, None]) == SlipMachine(LIMITS)


@given(st.lists(degrees, min_size=1, max_size=20))
def test_the_state_never_falls_while_the_degree_rises(rising: list[float]) -> None:
    order = ["none", "stick", "incipient", "slip"]
    machine, ranks = SlipMachine(LIMITS), []
    for degree in sorted(rising):
        machine.update(degree, "translation", 0.0)
        ranks.append(order.index(machine.name))
    assert ranks == sorted(ranks)


def test_gross_slip_keeps_the_onset_of_incipient_slip() -> None:
    machine = SlipMachine(LIMITS)
    for time_s, degree in enumerate([0.1, 0.5, 0.6, 0.9]):
        machine.update(degree, "rotation" if time_s < 3 else "translation", float(time_s))
    assert (machine.name, machine.kind, machine.onset_s) == ("slip", "rotation", 1.0)


def test_a_new_slip_has_a_new_onset() -> None:
    machine = SlipMachine(LIMITS)
    for time_s, degree in enumerate([0.5, 0.1, 0.5]):
        machine.update(degree, "translation", float(time_s))
    assert machine.onset_s == 2.0


def test_thresholds_out_of_order_are_refused() -> None:
    with pytest.raises(InputError, match="ordered"):
        Thresholds(incipient=0.4, incipient_ends=0.5, slip=0.75, slip_ends=0.6)


def test_a_state_ends_below_its_lower_threshold() -> None:
    machine = SlipMachine(Thresholds(incipient=0.3, incipient_ends=0.2, slip=0.6, slip_ends=0.5))
    names = []
    for degree in (0.1, 0.25, 0.35, 0.25, 0.55, 0.65, 0.55, 0.45, 0.55, 0.25, 0.15):
        machine.update(degree, "translation", 0.0)
        names.append(machine.name)
    begins = ["stick", "stick", "incipient", "incipient", "incipient", "slip"]
    assert names == [*begins, "slip", "incipient", "incipient", "incipient", "stick"]
