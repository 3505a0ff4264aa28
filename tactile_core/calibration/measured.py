"""What a calibration measures of the frames of calibration targets: slopes and heights."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

from tactile_core.algorithms.arrays.gradient import gradient
from tactile_core.algorithms.poisson import integrate
from tactile_core.calibration.target_surface import S
from tactile_core.interfaces.calibration import Calibration
from tactile_core.plugins.returned import measured_by
from tactile_core.quantities import Float32, Gradients, HeightMap, Reference


@dataclass(frozen=True, eq=False)
class Measured:
    """Slopes and heights of a frame, (H, W) each: one measured, the other derived from it.

    Attributes
    ----------
    gx, gy : (H, W) float32
    mm_per_px : float
    measured_mm : (H, W) float32 or None
        The heights, if they are measured.
    """

    gx: Float32
    gy: Float32
    mm_per_px: float
    measured_mm: Float32 | None = None

    @property
    def integrated(self) -> bool:
        """Whether the heights are derived from the slopes."""
        return self.measured_mm is None

    @cached_property
    def height_mm(self) -> Float32:
        """(H, W) heights; integrated only where something asks for them."""
        if self.measured_mm is not None:
            return self.measured_mm
        return integrate(self.gx, self.gy, mm_per_px=self.mm_per_px)

    @classmethod
    def of(cls, measured: Gradients | HeightMap) -> Self:
        """Take measured slopes, or differentiate heights."""
        scale = measured.mm_per_px
        if isinstance(measured, HeightMap):
            return cls(*gradient(measured.mm, scale), scale, measured.mm)
        return cls(measured.x, measured.y, scale)


def measured_frames(
    model: Calibration, surfaces: Iterable[S], undeformed: Reference
) -> Iterator[tuple[S, Measured]]:
    """Yield each surface with the measurement of its frame; a frame is measured once."""
    by_frame: dict[int, Measured] = {}
    for surface in surfaces:
        key = id(surface.frame)
        if key not in by_frame:
            by_frame[key] = Measured.of(measured_by(model, surface.frame, undeformed))
        yield surface, by_frame[key]
