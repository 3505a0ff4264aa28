"""A relative load: one number in files and in JSON lines."""

from __future__ import annotations

import numpy as np

from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Frame, RelativeLoad

known = RelativeLoad(0.25, timestamp_s=0.5)


def test_a_json_line_holds_the_number_itself() -> None:
    assert known.summary() == {"load": 0.25}
    frame = Frame(np.zeros((2, 2, 3), np.uint8), ("red", "green", "blue"), 0.1)
    assert Reading(frame, {}, {}).summary()["load"] is None
    assert Reading(frame, {RelativeLoad: known}, {}).summary()["load"] == 0.25


def test_files_hold_it_as_load() -> None:
    arrays = known.arrays()
    assert float(arrays["load"]) == 0.25
    again = RelativeLoad.from_arrays(arrays)
    assert (again.load, again.timestamp_s) == (0.25, 0.5)
