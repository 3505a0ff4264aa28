"""The artefact with the size of a unit's errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.readings import slopes

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import SlopeErrors

ERRORS = SlopeErrors(
    np.array([0.01, 0.5], np.float32), np.array([0.004, 0.05], np.float32), 0.02, 1.5
)


def test_errors_survive_a_bundle(tmp_path: Path) -> None:
    ERRORS.save(tmp_path)
    loaded = SlopeErrors.load(tmp_path)
    np.testing.assert_array_equal(loaded.slopes, ERRORS.slopes)
    np.testing.assert_array_equal(loaded.std, ERRORS.std)
    assert (loaded.gain_std, loaded.correlation_mm) == (0.02, 1.5)


def test_slopes_get_the_standard_deviation_of_their_size() -> None:
    steep = ERRORS.added_to(slopes(0.5))
    assert steep.std is not None
    assert steep.std.shape == steep.x.shape
    np.testing.assert_allclose(steep.std, 0.05, rtol=1e-5)
    np.testing.assert_array_equal(steep.x, slopes(0.5).x)


@pytest.mark.parametrize(
    ("slope", "std", "gain"),
    [([0.2, 0.1], [1, 1], 0), ([0.1], [1, 1], 0), ([], [], 0), ([0.1], [-1], 0), ([0.1], [1], -1)],
)
def test_a_table_that_cannot_be_is_refused(slope: list[float], std: list[float], gain: int) -> None:
    tables = (np.array(values, np.float32) for values in (slope, std))
    with pytest.raises(CalibrationError, match="increasing slopes"):
        SlopeErrors(*tables, gain, 1.0)  # type: ignore[call-arg,arg-type]


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="calibrate again"):
        SlopeErrors.load(tmp_path)
