"""The share of a contact that slips, and its standard deviation."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tactile_core.algorithms.slip.cues import (
    SLIPPED_SHARE,
    slipped_share,
    slipped_share_std,
)


@pytest.mark.parametrize("turned", [False, True])
def test_the_share_grows_with_the_evidence_from_nothing_to_all(turned: bool) -> None:
    shares = [slipped_share(evidence, turned=turned) for evidence in np.linspace(0, 1, 50)]
    assert shares[0] == 0
    assert shares[-1] > 0.99
    assert all(before <= after <= 1 for before, after in pairwise(shares))


@pytest.mark.parametrize("turned", [False, True])
def test_a_contact_that_partly_slips_is_least_certain(turned: bool) -> None:
    def std(share: float) -> float:
        return slipped_share_std(share, turned=turned, deceleration=0.0)

    assert std(0.25) > 2 * max(std(0.0), std(1.0))
    assert all(0 < std(share) < 0.5 for share in np.linspace(0, 1, 50))


def test_an_object_that_stops_may_have_slipped_or_not() -> None:
    moving, stopped = (
        slipped_share_std(0.6, turned=False, deceleration=slower) for slower in (0.0, 1.0)
    )
    assert stopped > 0.5 > moving


def test_each_knot_has_a_standard_deviation() -> None:
    use = SLIPPED_SHARE
    stds = use.std, use.slowing_std, use.turned_std
    assert {len(std) for std in stds} == {len(use.knots)}
    assert all(np.diff(use.knots) > 0)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("deceleration", [0.0, 0.6])
def test_the_standard_deviation_is_interpolated_between_knots(
    turned: bool, deceleration: float
) -> None:
    use = SLIPPED_SHARE
    values = (
        use.turned_std if turned else use.std if deceleration < use.slowing else use.slowing_std
    )
    for share in (-0.1, *np.linspace(0, 1, 41), 1.1):
        std = slipped_share_std(share, turned=turned, deceleration=deceleration)
        assert std == pytest.approx(np.interp(share, use.knots, values))
