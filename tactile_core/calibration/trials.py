"""What the calibrations on parts of the surfaces have in common."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Generic

from tactile_core.calibration.result import Fold
from tactile_core.calibration.target_surface import S
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Reference

# Fits a calibration to training samples and a reference.
Fit = Callable[[Sequence[Press], Reference], Calibration]


@dataclass(frozen=True, eq=False)
class Trials(Generic[S]):
    """Surfaces, and how a calibration is fitted without some of them.

    Attributes
    ----------
    surfaces : sequence of TargetSurface
        All that were found, unusable ones included.
    without : callable
        Maps indices of held-out surfaces to a :class:`Fold` of the others; None if none of the
        others can be used.
    reference : Reference
        Held-out surfaces are measured against it.
    fit : callable
        Fits a calibration to training samples and a reference.
    thickness_mm : float
        Thickness of the gel.
    undeformed : tuple of Press
        Additional training samples of the undeformed gel surface.
    """

    surfaces: Sequence[S]
    without: Callable[[Collection[int]], Fold[S] | None]
    reference: Reference
    fit: Fit
    thickness_mm: float
    undeformed: tuple[Press, ...] = ()

    @property
    def used(self) -> list[int]:
        """Indices of the surfaces that are good enough to fit on."""
        return [i for i, surface in enumerate(self.surfaces) if surface.used]

    def fit_all(self) -> Calibration:
        """Fit a calibration to all surfaces that are used."""
        training = [self.surfaces[i].training() for i in self.used]
        return self.fit([*training, *self.undeformed], self.reference)
