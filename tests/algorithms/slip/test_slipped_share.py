"""The share of a contact that slips, and its standard deviation."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tactile_core.algorithms.slip.slipped_share import (
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
    ends = [slipped_share_std(share, turned=turned) for share in (0.0, 1.0)]
    assert slipped_share_std(0.25, turned=turned) > 2 * max(ends)
    assert all(0 < slipped_share_std(share, turned=turned) < 0.5 for share in np.linspace(0, 1, 50))


def test_each_knot_has_a_standard_deviation() -> None:
    assert len(SLIPPED_SHARE.knots) == len(SLIPPED_SHARE.std) == len(SLIPPED_SHARE.turned_std)
    assert all(np.diff(SLIPPED_SHARE.knots) > 0)
