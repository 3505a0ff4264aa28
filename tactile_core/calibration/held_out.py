"""What is known while some surfaces are held out, told by the pixels of the others alone."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Generic

from tactile_core.calibration.known_surface import S
from tactile_core.calibration.presses import FoundPress, light_of, refound, relocated
from tactile_core.interfaces.calibrator import Press
from tactile_core.quantities import Reference


@dataclass(frozen=True, eq=False)
class Fold(Generic[S]):
    """Surfaces to fit on, and how one that was held out is found.

    Attributes
    ----------
    surfaces : sequence of KnownSurface
        Those that are used.
    reference : Reference
        The untouched sensor, as far as the fold may know it.
    find : callable
        A held-out surface by its number: where it lies, as what was not held out tells.
    at_rest : tuple of Press
        Samples of skin at rest, to fit on beside them.
    """

    surfaces: Sequence[S]
    reference: Reference
    find: Callable[[int], S]
    at_rest: tuple[Press, ...] = ()

    @property
    def samples(self) -> list[Press]:
        """All that a model is fitted on."""
        return [*(surface.training() for surface in self.surfaces), *self.at_rest]


@dataclass(frozen=True, eq=False)
class SeparatePresses:
    """Presses of a ball, each in a frame of its own.

    Attributes
    ----------
    presses : sequence of FoundPress
    reference : Reference
    given : bool
        Their circles were given, and are not searched.
    """

    presses: Sequence[FoundPress]
    reference: Reference
    given: bool = False

    def without(self, held_out: Collection[int]) -> Fold[FoundPress] | None:
        """Find the circles of the others anew, from their own starts; None if none is of use."""
        others = [press for i, press in enumerate(self.presses) if i not in held_out]
        if self.given:
            used = [press for press in others if press.used]
            return Fold(used, self.reference, self.presses.__getitem__) if used else None
        used = [press for press in refound(others) if press.used]
        if not used:
            return None
        light = light_of(used)
        return Fold(used, self.reference, lambda i: relocated(self.presses[i], light))
