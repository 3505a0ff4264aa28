"""A lattice of markers has strain where a contact deforms it, and nowhere else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.slip.marker_lattice import (
    MARKER_LATTICE,
    MarkerLattice,
    lattice_nodes,
)

COLUMNS, ROWS, PITCH_PX = 9, 7, 32.0
NODES = np.stack(np.meshgrid(np.arange(COLUMNS), np.arange(ROWS)), -1).reshape(-1, 2)
MIDDLE = (NODES - NODES.mean(axis=0)) * PITCH_PX
"""Undeformed markers relative to the centre of the image, px."""
SEEN = np.ones(len(MIDDLE), np.bool_)


def _dented(depth_px: float, at_px: tuple[float, float] = (20.0, -10.0)) -> NDArray[Any]:
    """Markers that an indenter about a pitch in radius spreads by up to this distance."""
    apart = MIDDLE - at_px
    size = np.linalg.norm(apart, axis=1, keepdims=True) / PITCH_PX
    return np.asarray(MIDDLE + depth_px * np.e**0.5 * apart / PITCH_PX * np.exp(-(size**2) / 2))


def _strain(px: NDArray[Any], first: NDArray[Any] = MIDDLE) -> float:
    strain = MarkerLattice(first).strain(px, SEEN, 0.0)
    assert strain is not None
    return strain


@settings(max_examples=30, deadline=None)
@given(
    st.floats(-0.7, 0.7),
    st.floats(0.5, 2),
    st.floats(-1e-6, 1e-6),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
def test_the_view_of_a_lens_and_its_pose_are_no_strain(
    angle_rad: float, scale: float, distortion: float, shift: tuple[float, float]
) -> None:
    bent = MIDDLE * (1 + distortion * (MIDDLE**2).sum(axis=1, keepdims=True))
    cosine, sine = scale * np.cos(angle_rad), scale * np.sin(angle_rad)
    px = bent @ np.array([[cosine, sine], [-sine, cosine]]) + shift
    assert _strain(px, px) < 1e-9


def test_the_strain_of_noise_is_the_noise() -> None:
    random = np.random.default_rng(0)
    strains = [_strain(MIDDLE + random.normal(0, 0.3, MIDDLE.shape)) for _ in range(50)]
    assert np.sqrt(np.mean(np.square(strains))) == pytest.approx(
        0.3 * np.sqrt(2) / PITCH_PX, rel=0.05
    )


def test_strain_is_proportional_to_the_spread_of_the_markers() -> None:
    strains = [_strain(_dented(depth_px)) for depth_px in (1.0, 2.0, 4.0)]
    assert strains[0] > 0.005
    assert strains[1:] == pytest.approx([2 * strains[0], 4 * strains[0]])


def test_a_contact_in_the_first_frame_hides_no_strain() -> None:
    """The lattice is its own reference."""
    dented = _dented(5.0)
    assert _strain(dented, dented) == pytest.approx(_strain(dented), rel=0.05)
    assert _strain(MIDDLE, dented) < 1e-9


@pytest.mark.parametrize("depth_px", [0.0, 1.0, 2.0, 4.0])
def test_a_lattice_is_recognised_under_an_object_with_bumps(depth_px: float) -> None:
    """Bumps six pitches apart displace neighbours in the same direction."""
    assert MarkerLattice(MIDDLE + depth_px * np.cos(MIDDLE * 2 * np.pi / (6 * PITCH_PX))).regular


@pytest.mark.parametrize("seed", range(5))
def test_markers_that_were_placed_one_by_one_have_no_strain(seed: int) -> None:
    random = np.random.default_rng(seed)
    printed = MIDDLE + random.normal(0, 0.04 * PITCH_PX, MIDDLE.shape)
    assert not MarkerLattice(printed).regular


def test_the_order_of_the_markers_is_irrelevant() -> None:
    order = np.random.default_rng(1).permutation(len(MIDDLE))
    dented = _dented(3.0)
    assert _strain(dented[order], MIDDLE[order]) == pytest.approx(_strain(dented))


def test_nodes_are_columns_and_rows_up_to_a_quarter_turn() -> None:
    chosen, nodes = lattice_nodes(_dented(5.0))
    assert len(chosen) == len(NODES)
    steps = NODES[chosen] - NODES[chosen[0]]
    turns = [steps @ np.linalg.matrix_power([[0, 1], [-1, 0]], number) for number in range(4)]
    assert any(np.array_equal(nodes, turned) for turned in turns)


def _hexagonal() -> NDArray[Any]:
    return np.asarray((NODES + np.outer(NODES[:, 1] % 2, (0.5, 0))) * (PITCH_PX, PITCH_PX * 0.866))


def _scattered() -> NDArray[Any]:
    return np.asarray(np.random.default_rng(2).uniform(0, 300, MIDDLE.shape))


@pytest.mark.parametrize(
    "px", [_hexagonal(), _scattered(), MIDDLE[:12], MIDDLE[:3], MIDDLE[:0]], ids=str
)
def test_markers_that_form_no_square_lattice_or_are_few_have_no_strain(px: NDArray[Any]) -> None:
    lattice = MarkerLattice(px)
    assert not lattice.regular
    assert lattice.strain(px, np.ones(len(px), np.bool_), 0.0) is None


def test_markers_that_were_never_seen_do_not_count() -> None:
    seen, wrong = SEEN.copy(), MIDDLE.copy()
    seen[10], wrong[10] = False, wrong[10] + 12
    strain = MarkerLattice(MIDDLE).strain(wrong, seen, 0.0)
    assert strain is not None
    assert strain < 1e-9


def test_markers_that_are_lost_in_a_contact_keep_its_strain_for_a_moment() -> None:
    dented = _dented(5.0)
    near = np.linalg.norm(MIDDLE - (20.0, -10.0), axis=1) < 1.5 * PITCH_PX
    unseen = MarkerLattice(MIDDLE).strain(dented, ~near, 0.0)
    lattice = MarkerLattice(MIDDLE)
    held = lattice.strain(dented, SEEN, 0.0)
    lost = lattice.strain(dented, ~near, 0.1)
    later = lattice.strain(dented, ~near, 0.2 + MARKER_LATTICE.hold_s)
    assert held is not None
    assert lost is not None
    assert unseen is not None
    assert unseen < 0.7 * held
    assert lost > 0.8 * held
    assert later == pytest.approx(unseen)


def test_strain_is_unknown_while_few_markers_are_seen() -> None:
    few = np.arange(len(MIDDLE)) < 14
    assert MarkerLattice(MIDDLE).strain(MIDDLE, few, 0.0) is None
