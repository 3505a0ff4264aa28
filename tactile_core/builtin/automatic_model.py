"""``core.automatic``: the model that the number of presses can carry."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, Self

from pydantic import BaseModel, Field

from tactile_core.builtin.mlp import Mlp, MlpOptions
from tactile_core.builtin.polynomial import Polynomial, PolynomialOptions
from tactile_core.builtin.slope_calibration import SlopeOptions
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration, Press
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference


class AutomaticOptions(SlopeOptions):
    """Options of ``core.automatic``."""

    presses_for_network: int = Field(
        default=8, ge=1, description="From so many presses on, core.mlp; below, core.polynomial."
    )


class Automatic(Calibration):
    """Chooses when it is fitted; what it returns is an ordinary fitted model.

    On two real sensors a network and a quadratic err alike with eight presses; with sixteen the
    network errs less by a sixth, with four it errs by half as much again.
    """

    Options: ClassVar[type[BaseModel]] = AutomaticOptions

    @classmethod
    def fit(cls, samples: Sequence[Press], reference: Reference, options: BaseModel) -> Calibration:
        """Fit ``core.polynomial`` or ``core.mlp``."""
        assert isinstance(options, AutomaticOptions)
        blur = options.model_dump(include=set(SlopeOptions.model_fields), exclude_unset=True)
        if len(samples) < options.presses_for_network:
            return Polynomial.fit(samples, reference, PolynomialOptions(**blur))
        return Mlp.fit(samples, reference, MlpOptions(**blur))

    def measure(self, frame: Frame, reference: Reference) -> Gradients | HeightMap:
        """Never called: what was fitted is another model."""
        raise CalibrationError(_NOT_FITTED)

    def save(self, directory: Path) -> None:
        """Never called: what was fitted is another model."""
        raise CalibrationError(_NOT_FITTED)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Never called: a bundle names the model that was chosen."""
        raise CalibrationError(_NOT_FITTED)


_NOT_FITTED = "core.automatic is only fitted; a bundle holds the model that it chose"
