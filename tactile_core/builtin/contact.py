"""``core.contact``: the contact mask from the height map."""

from __future__ import annotations

from pydantic import BaseModel, Field, NonNegativeFloat, PositiveFloat

from tactile_core.algorithms.contact import contact_mask
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import ContactMask, HeightMap
from tactile_core.quantities.on_demand import grid_of


class Contact(Estimator):
    """Segments regions that are deep, steep and large enough to be a contact."""

    class Options(device.Options):
        """Options of the step."""

        min_indentation_mm: NonNegativeFloat = Field(
            default=0.03,
            description="Least depth of a contact, mm, or 5 times the noise if that is more.",
        )
        border_fraction: float | None = Field(
            default=None,
            ge=0,
            lt=1,
            description="Depth at the border over the greatest depth. Default: from the slopes.",
        )
        min_slope: NonNegativeFloat = Field(
            default=0.1,
            description="Least slope of the flank of a contact, dimensionless, or 5 times the "
            "noise if that is more.",
        )
        min_area_mm2: PositiveFloat = Field(
            default=0.05, description="Least area of a contact, mm²; smaller regions are specks."
        )

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._thresholds = options.model_dump()

    def estimate(self, height: HeightMap) -> ContactMask:
        """Return the contact mask; all False when nothing touches."""
        grid = grid_of(height, "mm").of_image()
        mask = contact_mask(
            grid.cells,
            step_px=grid.step_px,
            mm_per_px=height.mm_per_px,
            **self._thresholds,
        )
        return ContactMask(mask, height.mm_per_px, height.timestamp_s)
