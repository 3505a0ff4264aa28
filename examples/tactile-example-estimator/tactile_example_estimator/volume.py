"""The volume of the indentation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import FieldSpec, HeightMap, Quantity, TimestampS


@dataclass(frozen=True, eq=False)
class Volume(Quantity):
    """Volume between the indented and the undeformed gel surface.

    Attributes
    ----------
    mm3 : float
        Volume in mm³, never negative.
    """

    mm3: Annotated[float, FieldSpec("mm³", saved_as="pressed_volume_mm3")]
    timestamp_s: TimestampS = 0.0


class VolumeOptions(Options):
    """Options of :class:`PressedVolume`."""

    min_height_mm: float = Field(
        default=0.0, ge=0, description="Smallest height in mm that counts; less is noise."
    )


class PressedVolume(Estimator):
    """Sums the height over the image; negative heights do not count."""

    Options = VolumeOptions
    options: VolumeOptions

    def estimate(self, height: HeightMap) -> Volume:
        """Return the volume of one height map."""
        pressed = height.mm[height.mm > self.options.min_height_mm]
        volume_mm3 = float(pressed.sum(dtype=np.float64)) * height.mm_per_px**2
        return Volume(volume_mm3, height.timestamp_s)
