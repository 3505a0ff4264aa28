"""Bundles of earlier versions are read, or refused with a sentence that says what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration

DATA = Path(__file__).parents[1] / "data"


def test_a_bundle_without_the_newest_fields_of_the_manifest_is_whole() -> None:
    bundle = Bundle.load(DATA / "recording" / "session" / "bundle")
    assert isinstance(bundle.calibration, Calibration)
    assert bundle.reference is not None
    assert bundle.errors is not None
    assert bundle.manifest.imported is None


def test_a_bundle_of_an_older_format_says_to_calibrate_again() -> None:
    folder = DATA / "bundle_of_format_4"
    with pytest.raises(CalibrationError) as refusal:
        Bundle.load(folder)
    assert str(refusal.value) == (
        f"bundle {folder}: format 4 is older than this version reads (5); move the folder away and "
        f"calibrate again"
    )
