"""A calibration that consists of one slope model."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Self

from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.slope_models.slope_model import SlopeFunction, SlopeModel
from tactile_core.quantities import Frame, Gradients, Reference


class SlopeCalibration(Calibration):
    """Measures with a slope model; a subclass names the class of the fitted function.

    Attributes
    ----------
    function : type of SlopeFunction
        Class of the function that :meth:`load` rebuilds.
    slopes : SlopeModel
    """

    function: ClassVar[type[SlopeFunction]]

    def __init__(self, slopes: SlopeModel[Any]) -> None:
        self.slopes = slopes

    def measure(self, frame: Frame, reference: Reference) -> Gradients:
        """Return the slopes of one frame; see :meth:`SlopeModel.measure`."""
        return self.slopes.measure(frame, reference)

    def save(self, directory: Path) -> None:
        """Write ``model.npz``."""
        self.slopes.save(directory)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``model.npz``; see :meth:`SlopeModel.load`."""
        return cls(SlopeModel.load(directory, cls.function))
