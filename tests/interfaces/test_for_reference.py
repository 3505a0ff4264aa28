"""An object is prepared once for each reference, and is not pickled."""

from __future__ import annotations

import pickle

import numpy as np

from tactile_core.interfaces.for_reference import ForReference
from tactile_core.quantities import Reference

prepared: list[Reference] = []


def prepare(reference: Reference) -> float:
    prepared.append(reference)
    return float(reference.pixels.mean())


def reference(level: float) -> Reference:
    return Reference(np.full((2, 3, 1), level, np.float32), ("grey",))


def test_a_value_is_prepared_again_only_for_a_new_reference() -> None:
    prepared.clear()
    field, one, other = ForReference(prepare), reference(1), reference(2)
    assert [field(each) for each in (one, one, other, other, one)] == [1, 1, 2, 2, 1]
    assert [each is one for each in prepared] == [True, False, True]


def test_a_pickle_prepares_again() -> None:
    field, one = ForReference(prepare), reference(1)
    field(one)
    again = pickle.loads(pickle.dumps(field))
    prepared.clear()
    assert again(one) == 1
    assert prepared == [one]
