"""``tactip.no_slopes``: why ``tactile calibrate`` has nothing to fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration, Calibrator, Press
from tactile_core.quantities import Reference


class NoSlopes(Calibrator):
    """Pins move, but their brightness says nothing about slopes: there is no light to calibrate."""

    refusal: ClassVar[str] = (
        "this sensor has pins and no photometry, so no press of a ball calibrates it; fit "
        "distance and angle of a surface with 'tactile calibrate-surface'"
    )

    def fit(self, presses: Sequence[Press], reference: Reference) -> Calibration:
        """Refuse.

        Raises
        ------
        CalibrationError
            Always.
        """
        raise CalibrationError(self.refusal)
