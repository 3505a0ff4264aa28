"""Mixing of the steps of an alternation."""

import numpy as np

from tactile_core.algorithms.circles.finder import MIXING, Mixing

SLOW = np.diag([0.95, 0.9, 0.8, 0.3, 0.1, 0.0])
"""Share of the distance that each direction keeps in one iteration."""
GOAL = np.array([[1.0, -2.0, 3.0], [0.5, 0.25, -4.0]])


def step_from(place: np.ndarray) -> np.ndarray:
    """One iteration of an alternation that converges to the goal, at six speeds."""
    return ((np.eye(6) - SLOW) @ (GOAL - place).ravel()).reshape(place.shape)


def distance_after(rounds: int, *, mixing: Mixing | None) -> float:
    place = np.zeros_like(GOAL)
    for _ in range(rounds):
        step = step_from(place)
        place = place + (step if mixing is None else mixing.mix_step(place, step))
    return float(np.abs(place - GOAL).max())


def test_the_first_step_is_as_it_is() -> None:
    step = step_from(np.zeros_like(GOAL))
    assert np.array_equal(Mixing().mix_step(np.zeros_like(GOAL), step), step)


def test_mixed_steps_converge_in_a_few_rounds_where_plain_ones_do_not() -> None:
    assert distance_after(10, mixing=None) > 0.5
    assert distance_after(10, mixing=Mixing()) < 0.1


def test_steps_of_one_speed_are_extended_to_the_goal() -> None:
    mixing, goal = Mixing(), np.array([3.0, -1.0])
    place = np.zeros(2)
    for _ in range(2):
        place = place + mixing.mix_step(place, 0.2 * (goal - place))
    assert np.abs(place - goal).max() < 10 * MIXING.ridge


def test_where_nothing_moves_nothing_is_mixed() -> None:
    mixing, place = Mixing(), np.ones((2, 2))
    for _ in range(3):
        assert np.array_equal(mixing.mix_step(place, np.zeros((2, 2))), np.zeros((2, 2)))
