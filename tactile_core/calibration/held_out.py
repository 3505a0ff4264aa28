"""Folds of the cross-validation: nothing in a fold depends on the pixels that it holds out."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Generic

from tactile_core.calibration.press_search import light_of, refound, relocated
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.target_surface import S
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Reference


@dataclass(frozen=True, eq=False)
class Fold(Generic[S]):
    """Surfaces to fit on, and a way to locate those that are held out.

    Attributes
    ----------
    surfaces : sequence of TargetSurface
        The training surfaces that are used.
    reference : Reference
        The undeformed sensor, derived without the held-out pixels.
    find : callable
        Maps the index of a held-out surface to that surface, located with a light model that was
        fitted to the training surfaces alone.
    undeformed : tuple of Press
        Additional training samples of the undeformed gel surface.
    """

    surfaces: Sequence[S]
    reference: Reference
    find: Callable[[int], S]
    undeformed: tuple[Press, ...] = ()

    @property
    def samples(self) -> list[Press]:
        """All training samples."""
        return [*(surface.training() for surface in self.surfaces), *self.undeformed]


@dataclass(frozen=True, eq=False)
class SeparatePresses:
    """Presses of a ball, each in a frame of its own.

    Attributes
    ----------
    presses : sequence of FoundPress
    reference : Reference
    labelled : bool
        The circles come from labels and are not searched for.
    """

    presses: Sequence[FoundPress]
    reference: Reference
    labelled: bool = False

    def without(self, held_out: Collection[int]) -> Fold[FoundPress] | None:
        """Search the circles of the other presses again, without the held-out ones.

        Returns
        -------
        Fold, or None if no other press can be used
        """
        others = [press for i, press in enumerate(self.presses) if i not in held_out]
        if self.labelled:
            used = [press for press in others if press.used]
            return Fold(used, self.reference, self.presses.__getitem__) if used else None
        used = [press for press in refound(others) if press.used]
        if not used:
            return None
        light = light_of(used)
        return Fold(used, self.reference, lambda i: relocated(self.presses[i], light))
